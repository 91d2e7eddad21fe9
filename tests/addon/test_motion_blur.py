"""Motion blur: what is read from Blender's frames, and pictures beside Cycles', block of pixels by block (block_comparison)."""

import math

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest
from cycles_reference import assert_agree, cycles_pictures, our_pictures
from sppm import compat
from sppm.export_motion import Shutter
from sppm.export_scene import export_scene

FRAME = 5  # of the picture
# Noise apart, a block may differ by what Cycles 3.4 loses where rays hit the shared edge of two triangles
# (test_cycles_scenes.py).
ALLOWANCE = 0.002
PRECISION = 0.02
POSITIONS = {"START": (0.0, 1.0), "CENTER": (-0.5, 0.5), "END": (-1.0, 0.0)}  # where the shutter opens and closes, in shutters


@pytest.fixture
def scene():
    """A block on a floor under a wide lamp, seen from its side; the shutter is open for 4 frames around frame 5."""
    scene = blender_scene.start(64, 64, iterations=64, world=(0.3, 0.3, 0.3))
    scene.sppm.indirect = "PATHS"
    bpy.ops.mesh.primitive_plane_add(size=6, location=(0.0, 0.0, -0.9))
    bpy.ops.mesh.primitive_cube_add(size=1)
    bpy.context.object.name = "Block"
    for thing in scene.objects:
        thing.data.materials.append(make_scenes.diffuse("White", (0.8, 0.8, 0.8)))
    bpy.ops.object.light_add(type="AREA", location=(1.0, -2.0, 3.0))
    lamp = bpy.context.object
    lamp.name, lamp.data.energy, lamp.data.size = "Lamp", 150.0, 1.0
    make_scenes.aim(lamp, lamp.location, (0.0, 0.0, 0.0))
    bpy.ops.object.camera_add(location=(0.0, -4.0, 1.5), rotation=(math.radians(72), 0.0, 0.0))
    scene.camera = bpy.context.object
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 4.0
    scene.frame_set(FRAME)
    return scene


def animate(thing, path, *values, frames=(0, 10)):
    """Keys of one property, at these frames; with two of them it changes as Blender eases it, not evenly."""
    for frame, value in zip(frames, values):
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=frame)
    bpy.context.scene.frame_set(FRAME)


def turn_and_move(thing):
    thing.rotation_mode = "XYZ"
    animate(thing, "location", (-0.5, 0.0, 0.0), (0.5, 0.3, 0.2))
    animate(thing, "rotation_euler", (0.0, 0.0, 0.0), (0.3, 2.5, 0.2))


def move_camera(scene):
    animate(scene.camera, "location", (-0.8, -4.0, 1.5), (0.8, -3.5, 1.7))
    animate(scene.camera.data, "lens", 40.0, 60.0)


def export(scene):
    """The description and the messages, as a render has them but for the engine: the scene itself goes to the frames."""
    depsgraph = bpy.context.evaluated_depsgraph_get()

    def frame_set(frame, subframe):
        scene.frame_set(frame, subframe=subframe)

    return export_scene(depsgraph, shutter=Shutter(scene, frame_set))


def named(items, name):
    return next(item for item in items if item.name == name)


# ---------------------------------------------------------------- what is read


@pytest.mark.parametrize("stretched", [100, 200], ids="{} frames for 100".format)
def test_places_are_those_of_the_frames(scene, stretched):
    scene.render.frame_map_new = stretched
    block = bpy.data.objects["Block"]
    turn_and_move(block)
    for position, ends in POSITIONS.items():
        setattr(*compat.motion_blur_position(scene), position)
        desc, messages = export(scene)
        assert (scene.frame_current, scene.frame_subframe) == (FRAME, 0)
        expected = []
        for share in (ends[0], sum(ends) / 2, ends[1]):
            frame = FRAME + 4.0 * share
            scene.frame_set(math.floor(frame), subframe=frame % 1)
            expected.append(np.array(block.matrix_world)[:3])
        scene.frame_set(FRAME)
        found = named(desc.instances, "Block")
        np.testing.assert_allclose(found.motion, expected, atol=1e-6)
        np.testing.assert_allclose(found.transform, expected[1], atol=1e-6)
        assert [item.name for item in desc.instances + desc.lights if item.motion is not None] == ["Block"]
        assert not desc.camera_motion and not messages


def test_more_steps_where_an_object_wants_them_and_none_where_it_does_not(scene):
    block = bpy.data.objects["Block"]
    turn_and_move(block)
    move_camera(scene)
    block.cycles.motion_steps = 3
    desc, _ = export(scene)
    assert named(desc.instances, "Block").motion.shape == (9, 3, 4)
    assert len(desc.camera_motion) == 3
    block.cycles.use_motion_blur = False
    desc, _ = export(scene)
    assert named(desc.instances, "Block").motion is None


def test_instances_of_a_collection_and_lamps_move_with_their_empty(scene):
    group = bpy.data.collections.new("Group")
    for name in ("Block", "Lamp"):
        thing = bpy.data.objects[name]
        group.objects.link(thing)
        scene.collection.objects.unlink(thing)
    for x in (-1.0, 1.0):
        bpy.ops.object.collection_instance_add(collection="Group")
        empty = bpy.context.object
        animate(empty, "location", (x, 0.0, 0.0), (x, 0.0, x))
    desc, _ = export(scene)
    blocks = [item for item in desc.instances if item.name == "Block"]
    assert len(blocks) == 2 and blocks[0].mesh == blocks[1].mesh
    for block, lamp in zip(blocks, desc.lights):
        x = block.transform[0, 3]
        assert abs(x) == 1.0
        rise = np.diff(block.motion[:, 2, 3])
        assert (np.sign(rise) == np.sign(x)).all()
        np.testing.assert_allclose(lamp.motion - lamp.motion[1], block.motion - block.motion[1], atol=1e-6)


def test_far_from_the_origin_motions_move_with_the_scene(scene):
    turn_and_move(bpy.data.objects["Block"])
    move_camera(scene)
    near, _ = export(scene)
    bpy.ops.object.empty_add(location=(0.0, 0.0, 0.0))
    far = bpy.context.object
    for thing in scene.objects:
        if thing is not far:
            thing.parent = far
    far.location = (4096.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    moved, _ = export(scene)
    assert any(moved.origin)
    offset = np.array((4096.0, 0.0, 0.0)) - moved.origin
    was, now = (named(desc.instances, "Block").motion for desc in (near, moved))
    np.testing.assert_allclose(now[..., 3] - offset, was[..., 3], atol=1e-3)
    for was, now in zip(near.camera_motion, moved.camera_motion):
        np.testing.assert_allclose(now.transform[:, 3] - offset, was.transform[:, 3], atol=1e-3)


def test_what_is_not_blurred_is_named(scene):
    block = bpy.data.objects["Block"]
    block.shape_key_add(name="Basis")
    key = block.shape_key_add(name="Tall")
    for point in key.data:
        point.co.z *= 2.0
    animate(key, "value", 0.0, 1.0)
    scene.cycles.rolling_shutter_type = "TOP"
    scene.render.motion_blur_shutter_curve.curves[0].points[0].location = (0.0, 0.0)
    _, messages = export(scene)
    for words in ("'Block': deformation is not blurred", "rolling shutter", "shutter curve"):
        assert sum(words in message for message in messages) == 1, messages


def test_without_motion_blur_nothing_is_read_twice(scene, tmp_path):
    turn_and_move(bpy.data.objects["Block"])
    moving = blender_scene.render(tmp_path / "moving.exr")
    assert scene.frame_current_final == FRAME
    scene.render.use_motion_blur = False
    still = blender_scene.render(tmp_path / "still.exr")
    assert not np.array_equal(moving, still)
    desc, _ = export_scene(bpy.context.evaluated_depsgraph_get())
    assert all(item.motion is None and not item.movable for item in desc.instances)


# ---------------------------------------------------------------- beside Cycles


@pytest.mark.parametrize("position", [pytest.param(name, marks=[pytest.mark.slow] * (name != "END")) for name in POSITIONS])
def test_a_block_that_turns_and_moves(scene, position, tmp_path):
    setattr(*compat.motion_blur_position(scene), position)
    turn_and_move(bpy.data.objects["Block"])
    assert_agree(f"motion-{position}", our_pictures(tmp_path), cycles_pictures(tmp_path, 64), ALLOWANCE, PRECISION)


def test_a_camera_that_moves_and_zooms(scene, tmp_path):
    move_camera(scene)
    assert_agree("motion-camera", our_pictures(tmp_path), cycles_pictures(tmp_path, 64), ALLOWANCE, PRECISION)


@pytest.mark.slow
def test_an_emitter_that_moves(scene, tmp_path):
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    block = bpy.data.objects["Block"]
    block.scale = (0.3, 0.3, 0.3)
    block.data.materials[0] = make_scenes.node_material("Glow", "ShaderNodeEmission", {"Strength": 20.0})
    turn_and_move(block)
    assert_agree("motion-emitter", our_pictures(tmp_path), cycles_pictures(tmp_path, 128), ALLOWANCE, PRECISION)
