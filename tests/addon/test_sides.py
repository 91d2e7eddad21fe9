"""Front and back as Cycles has them, and smooth shading on coarse meshes: all light, block by block, with caustics on both sides.

The lamps are so wide that Cycles meets them by chance. An open sheet of glass is not here: what lies behind it lies in glass, and
Cycles does not scale radiance there. Photons are gathered within an eighth of a pixel, so that what a kernel loses at
edges is below the noise.
"""

import math

import blender_scene
import bpy
import make_scenes
import pytest
from cycles_reference import assert_agree, cycles_pictures, our_pictures
from mathutils import Matrix

SIZE, SAMPLES = 32, 64
GREY, RED = (0.5, 0.5, 0.5), (0.7, 0.2, 0.1)


@pytest.fixture
def stage():
    """A floor and a wall behind it, dim sky."""
    scene = blender_scene.start(SIZE, SIZE, SAMPLES, world=(0.05, 0.06, 0.08))
    scene.sppm.photons_per_iteration = 32 * SIZE * SIZE
    scene.sppm.initial_radius = 0.01
    make_scenes.add_floor(3.0, make_scenes.diffuse("Floor", GREY))
    make_scenes.add_quad("Wall", (-1.5, 1.5, 0), (1.5, 1.5, 0), (1.5, 1.5, 2), (-1.5, 1.5, 2), make_scenes.diffuse("Wall", GREY))
    make_scenes.add_camera((0.2, -3.4, 1.8), (0, 0.2, 0.5), lens=50)
    return scene


def wide_lamp(energy=60.0):
    return make_scenes.add_lamp("AREA", (-1.1, -0.8, 1.9), (0, 0, 0.3), energy, size=0.9)


def upright_square(material, half=0.4, turn=0.0):
    """Its front toward the camera."""
    square = make_scenes.add_quad("Square", (-half, 0, 0.2), (half, 0, 0.2), (half, 0, 1), (-half, 0, 1), material)
    square.rotation_euler.z = math.radians(turn)
    return square


def turn_inside_out(thing):
    thing.data.flip_normals()
    return thing


def shine():
    return make_scenes.node_material("Shine", "ShaderNodeEmission", {"Color": (1.0, 0.9, 0.7), "Strength": 3.0})


def lamp_of_one_side():
    """Edge on above the floor: the part of it behind the lamp stays dark."""
    make_scenes.add_lamp("AREA", (0, 0, 0.6), (1, 0, 0.5), 20.0, size=0.6)


def lamp_in_a_mirror():
    """A mirror sees the lamp's back, which is not there, and another its front."""
    make_scenes.add_lamp("AREA", (0, 0.2, 0.8), (0, 1.0, 0.7), 20.0, size=0.5)
    for x, y in ((-0.6, 0.9), (0.6, -0.5)):
        make_scenes.add_sphere("Ball", (x, y, 0.3), 0.3, make_scenes.metal("Mirror", (0.9, 0.9, 0.9)))


def emitter_of_two_sides():
    upright_square(shine(), turn=50)


def emitter_turned_round():
    turn_inside_out(upright_square(shine(), turn=50))


def diffuse_turned_round():
    wide_lamp()
    turn_inside_out(upright_square(make_scenes.diffuse("Red", RED), turn=30))


def glass_ball():
    wide_lamp()
    return make_scenes.add_sphere("Ball", (0, 0, 0.5), 0.45, make_scenes.glass("Glass"))


def glass_ball_inside_out():
    """The world is glass and the ball is a bubble."""
    turn_inside_out(glass_ball())


def glass_ball_mirrored():
    """Negative scale turns the triangles round; their outside stays outside."""
    glass_ball().scale = (-1, 1, 1)


def glass_ball_mirrored_in_its_mesh():
    """The same done to the vertices leaves it inside out."""
    glass_ball().data.transform(Matrix.Diagonal((-1, 1, 1, 1)))


def plastic_inside_out():
    wide_lamp()
    turn_inside_out(make_scenes.add_sphere("Ball", (0, 0, 0.5), 0.45, make_scenes.principled("Red", RED, Roughness=0.4)))


SIDES = (lamp_of_one_side, lamp_in_a_mirror, emitter_of_two_sides, emitter_turned_round, diffuse_turned_round, glass_ball,
         glass_ball_inside_out, glass_ball_mirrored, glass_ball_mirrored_in_its_mesh, plastic_inside_out)


def assert_like_cycles(name, folder):
    assert_agree(name, our_pictures(folder), cycles_pictures(folder, 2 * SAMPLES), allowance=0.005, precision=0.015)


@pytest.mark.slow
@pytest.mark.parametrize("add", SIDES, ids=lambda add: add.__name__)
def test_sides(add, stage, tmp_path):
    add()
    assert_like_cycles(add.__name__, tmp_path)


def coarse_diffuse_ball():
    return make_scenes.diffuse("Ball", (0.8, 0.5, 0.3))


def coarse_metal_ball():
    return make_scenes.metal("Ball", (0.9, 0.7, 0.4), 0.3)


def coarse_mirror_ball():
    return make_scenes.metal("Ball", (0.9, 0.7, 0.4))


COARSE = (coarse_diffuse_ball, *(pytest.param(make, marks=pytest.mark.slow) for make in (coarse_metal_ball, coarse_mirror_ball)))


@pytest.mark.parametrize("make", COARSE, ids=lambda make: make.__name__)
def test_smooth_shading_of_a_coarse_ball(make, stage, tmp_path):
    """Twelve by six faces with the normals of a sphere: what the camera sees of the ball, and the light that photons carry from
    it to the floor and the wall, are what Cycles finds from the camera's end.
    """
    wide_lamp()
    make_scenes.add_sphere("Ball", (0, 0.3, 0.5), 0.45, make(), segments=12, rings=6)
    assert_like_cycles(make.__name__, tmp_path)
