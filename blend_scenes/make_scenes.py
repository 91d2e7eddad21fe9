"""Makes every scene of this folder, one function a scene.

    ./dev blender -b --factory-startup --python blend_scenes/make_scenes.py [-- NAME...]

Nothing here is random between runs. Use Blender 3.4, the oldest that is supported: later versions open its files.
All lengths are metres. README.md says what each scene is hard for.
"""

import math
import random
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

FOLDER = Path(__file__).resolve().parent
WHITE = (0.75, 0.75, 0.75)
RED = (0.63, 0.06, 0.05)
GREEN = (0.14, 0.45, 0.09)

# ---------------------------------------------------------------- scene


def start_scene(world=(0.0, 0.0, 0.0)):
    """Empties Blender's file and sets what all scenes share; `world` is a constant radiance."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    render = scene.render
    render.resolution_x = render.resolution_y = 512
    render.resolution_percentage = 100
    scene.view_settings.view_transform = "Standard"
    scene.unit_settings.system = "METRIC"
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*world, 1.0)
    return scene


def save_scene(name):
    """Chooses the engine, where it is there, and writes NAME.blend."""
    scene = bpy.context.scene
    try:
        scene.render.engine = "SPPM"
    except TypeError:
        print("make_scenes: the SPPM add-on is not enabled; the scene keeps another engine", file=sys.stderr)
    if hasattr(scene, "sppm"):
        scene.sppm.iterations = 64
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / f"{name}.blend"), compress=True)


def link(name, data, collection=None):
    """A new object of the data, in the scene's collection or the one given."""
    made = bpy.data.objects.new(name, data)
    (collection or bpy.context.scene.collection).objects.link(made)
    return made


def aim(thing, location, target):
    """Puts a camera or lamp somewhere and turns its -z toward the target."""
    thing.location = location
    direction = Vector(target) - Vector(location)
    thing.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    return thing


def add_camera(location, target, lens=50.0):
    camera = bpy.data.cameras.new("Camera")
    camera.lens = lens
    camera.clip_start = 0.001
    bpy.context.scene.camera = aim(link("Camera", camera), location, target)
    return camera


def add_lamp(kind, location, target, power, **settings):
    """A lamp of Blender's kind; watts, for a sun W/m^2. `settings` are attributes of the lamp."""
    lamp = bpy.data.lights.new(kind.title(), kind)
    lamp.energy = power
    for name, value in settings.items():
        setattr(lamp, name, value)
    return aim(link(kind.title(), lamp), location, target)


# ---------------------------------------------------------------- materials


def node_material(name, node_type, inputs):
    """A material of one shader node with constant inputs."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader, output = nodes.new(node_type), nodes.new("ShaderNodeOutputMaterial")
    output.location.x = 300
    links.new(shader.outputs[0], output.inputs["Surface"])
    for socket, value in inputs.items():
        shader.inputs[socket].default_value = (*value, 1.0) if isinstance(value, tuple) else value
    return material


def diffuse(name, color):
    return node_material(name, "ShaderNodeBsdfDiffuse", {"Color": color})


def principled(name, color, **inputs):
    return node_material(name, "ShaderNodeBsdfPrincipled", {"Base Color": color, **inputs})


def metal(name, color, roughness=0.0):
    return principled(name, color, Metallic=1.0, Roughness=roughness)


def glass(name, ior=1.5, color=(1.0, 1.0, 1.0)):
    return node_material(name, "ShaderNodeBsdfGlass", {"Color": color, "Roughness": 0.0, "IOR": ior})


def use_image(material, image):
    """Feeds the image, by the active UV map, to the colour of the material's shader."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    texture.location.x = -300
    shader = next(node for node in nodes if node.type.startswith("BSDF"))
    links.new(texture.outputs["Color"], shader.inputs[0])
    return material


def pack_image(name, pixels, is_float=False):
    """A packed image from an (height, width, 3) array, rows from bottom to top."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height, float_buffer=is_float)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    return image


# ---------------------------------------------------------------- meshes


def add_mesh(name, vertices, faces, material, smooth=False, collection=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, v)) for v in vertices], [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    if material:
        mesh.materials.append(material)
    mesh.validate()
    mesh.update()
    return link(name, mesh, collection)


def add_quad(name, a, b, c, d, material, tiles=None):
    """A rectangle, its front toward the viewer who sees a, b, c, d counter-clockwise; `tiles` gives UVs that repeat so often."""
    quad = add_mesh(name, [a, b, c, d], [(0, 1, 2, 3)], material)
    if tiles:
        uv = quad.data.uv_layers.new(name="UVMap")
        for loop, corner in zip(uv.data, [(0, 0), (1, 0), (1, 1), (0, 1)]):
            loop.uv = (corner[0] * tiles[0], corner[1] * tiles[1])
    return quad


def add_floor(size, material, z=0.0):
    s = size / 2
    return add_quad("Floor", (-s, -s, z), (s, -s, z), (s, s, z), (-s, s, z), material)


def add_box(name, center, size, material, turn=0.0, collection=None):
    corners = [(x, y, z) for z in (-0.5, 0.5) for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    faces = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    box = add_mesh(name, np.array(corners) * size, faces, material, collection=collection)
    box.location = center
    box.rotation_euler.z = math.radians(turn)
    return box


def add_lathe(name, profile, material, segments=64, smooth=True, collection=None):
    """Turns a profile of (radius, height), from the lower to the upper end of the outside, about z; ends on the axis close it."""
    vertices, rings = [], []
    for radius, height in profile:
        count = segments if radius > 0 else 1
        rings.append([len(vertices) + i for i in range(count)])
        angles = np.arange(count) * (2 * math.pi / count)
        vertices += [(radius * math.cos(t), radius * math.sin(t), height) for t in angles]
    faces = []
    for low, high in zip(rings, rings[1:]):
        for i in range(max(len(low), len(high))):
            a, b = low[i % len(low)], low[(i + 1) % len(low)]
            c, d = high[(i + 1) % len(high)], high[i % len(high)]
            faces.append(tuple(dict.fromkeys((a, b, c, d))))
    return add_mesh(name, vertices, faces, material, smooth, collection)


def add_sphere(name, center, radius, material, segments=64, rings=32, collection=None):
    angles = np.linspace(-math.pi / 2, math.pi / 2, rings + 1)
    profile = [(radius * math.cos(t), radius * math.sin(t)) for t in angles]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    sphere = add_lathe(name, profile, material, segments, collection=collection)
    sphere.location = center
    return sphere


def round_profile(points, steps=8):
    """A Catmull-Rom curve through (radius, height) points; what starts and ends on the axis stays there."""
    p = np.array([points[0], *points, points[-1]], float)
    curve = []
    for a, b, c, d in zip(p, p[1:], p[2:], p[3:]):
        for t in np.arange(steps) / steps:
            curve.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3))
    curve.append(p[-1])
    curve = np.maximum(np.array(curve), [0.0, -math.inf])
    curve[1:-1, 0] = np.maximum(curve[1:-1, 0], 1e-4)
    return [tuple(point) for point in curve]


def add_cornell_box():
    """A room of 2 m, open toward the camera in front of it, under a square area light."""
    white = diffuse("White", WHITE)
    add_quad("Floor", (-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), white)
    add_quad("Ceiling", (-1, 1, 2), (1, 1, 2), (1, -1, 2), (-1, -1, 2), white)
    add_quad("Back", (-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2), white)
    add_quad("Left", (-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2), diffuse("Red", RED))
    add_quad("Right", (1, 1, 0), (1, -1, 0), (1, -1, 2), (1, 1, 2), diffuse("Green", GREEN))
    add_lamp("AREA", (0, 0, 1.99), (0, 0, 0), 26.0, size=0.5)
    add_camera((0, -3.85, 1.0), (0, 0, 1.0))
    return white


# ---------------------------------------------------------------- scenes


def cornell_glass():
    start_scene()
    add_cornell_box()
    add_sphere("Mirror", (-0.45, 0.3, 0.42), 0.42, metal("Silver", (0.95, 0.95, 0.95)))
    add_sphere("Glass", (0.42, -0.3, 0.42), 0.42, glass("Glass"))


def cornell_diffuse():
    start_scene()
    white = add_cornell_box()
    add_box("Tall", (-0.35, 0.3, 0.6), (0.6, 0.6, 1.2), white, turn=17)
    add_box("Short", (0.35, -0.3, 0.3), (0.6, 0.6, 0.6), white, turn=-18)


def ring():
    start_scene()
    add_floor(0.6, diffuse("Paper", (0.7, 0.68, 0.65)))
    gold = metal("Gold", (0.95, 0.7, 0.3))
    inner, outer, height = 0.05, 0.053, 0.022
    band = [(outer, 0.0), (outer, height), (inner, height), (inner, 0.0), (outer, 0.0)]
    for name, low, high in zip(("Outside", "Rim", "Inside", "Foot"), band, band[1:]):
        add_lathe(f"Ring {name}", [low, high], gold, segments=256)
    add_lamp("POINT", (-0.16, 0.10, 0.13), (0, 0, 0), 0.9, shadow_soft_size=0.002)
    add_camera((0.03, -0.22, 0.24), (0.003, -0.004, 0.005), lens=60.0)


def pool():
    start_scene()
    half, depth, rim = 2.0, 1.2, 0.25
    tile = use_image(diffuse("Tiles", WHITE), tile_image())
    s, z, top = half, -depth, rim
    add_quad("Floor", (-s, -s, z), (s, -s, z), (s, s, z), (-s, s, z), tile, (5, 5))
    walls = [(-s, -s), (-s, s), (s, s), (s, -s)]
    for name, a, b in zip(("West", "North", "East", "South"), walls, walls[1:] + walls[:1]):
        add_quad(name, (*a, z), (*b, z), (*b, top), (*a, top), tile, (5, 5 * (top - z) / (2 * s)))
    add_water(half + 0.02, cells=72)
    add_lamp("POINT", (0.7, 0.9, 2.6), (0, 0, 0), 500.0, shadow_soft_size=0.02)
    add_camera((0.0, -1.75, 2.3), (0.0, 0.1, -0.75), lens=28.0)


def tile_image(size=128, count=4):
    """Count x count pool tiles in slightly different blues, light joints between them."""
    shade = random.Random(7)
    pixels = np.empty((size, size, 3), np.float32)
    pixels[:] = (0.80, 0.82, 0.80)
    edge = size // count
    for row in range(count):
        for column in range(count):
            tone = shade.uniform(0.85, 1.1)
            area = (slice(row * edge + 1, (row + 1) * edge - 1), slice(column * edge + 1, (column + 1) * edge - 1))
            pixels[area] = np.array((0.38, 0.66, 0.74)) * tone
    return pack_image("Tiles", pixels)


def add_water(half, cells):
    """An open, subdivided sheet at z = 0: few plane waves, about 2 cm high, that focus near the floor."""
    turn = random.Random(3)
    waves = [(0.011 * 0.72**i, 1.15 * 0.72**i, turn.uniform(0, 2 * math.pi), turn.uniform(0, 2 * math.pi)) for i in range(6)]
    axis = np.linspace(-half, half, cells + 1)
    x, y = np.meshgrid(axis, axis)
    z = sum(
        a * np.sin(2 * math.pi / length * (x * math.cos(way) + y * math.sin(way)) + phase) for a, length, way, phase in waves
    )
    n = cells + 1
    faces = [(r * n + c, r * n + c + 1, (r + 1) * n + c + 1, (r + 1) * n + c) for r in range(cells) for c in range(cells)]
    water = add_mesh("Water", np.stack([x, y, z], -1).reshape(-1, 3), faces, glass("Water", 1.33), smooth=True)
    subdivision = water.modifiers.new("Subdivision", "SUBSURF")
    subdivision.levels = subdivision.render_levels = 2
    subdivision.boundary_smooth = "PRESERVE_CORNERS"


def sun_glass():
    start_scene(world=(0.02, 0.025, 0.03))
    add_floor(3.0, diffuse("Floor", (0.6, 0.57, 0.53)))
    clear = glass("Glass")
    add_sphere("Ball", (-0.05, -0.05, 0.0302), 0.03, clear)
    add_goblet(clear).location = (0.04, 0.03, 0.0002)
    add_lamp("SUN", (0.5, 0.35, 0.6), (0, 0, 0), 1.3, angle=math.radians(0.5))
    lamp = add_lamp("SPOT", (-0.55, 0.25, 0.5), (0.0, 0.0, 0.03), 8.0, shadow_soft_size=0.004)
    lamp.data.spot_size, lamp.data.spot_blend = math.radians(40), 0.3
    add_camera((0.02, -0.42, 0.27), (-0.01, -0.012, 0.033), lens=50.0)


def add_goblet(material, height=0.13):
    """A wine glass of solid glass: up the outside, down the inside of one 13 cm high, then scaled to `height`."""
    outside = [(0.0, 0.0), (0.02, 0.0), (0.030, 0.001), (0.0305, 0.0025), (0.018, 0.005), (0.006, 0.010), (0.0038, 0.02)]
    outside += [(0.0036, 0.045), (0.006, 0.056), (0.019, 0.064), (0.030, 0.08), (0.032, 0.098), (0.0272, 0.129)]
    inside = [(0.0264, 0.130), (0.0256, 0.129), (0.0303, 0.098), (0.0283, 0.081), (0.0175, 0.066), (0.007, 0.0605), (0.0, 0.06)]
    scale = height / 0.13
    profile = [(scale * radius, scale * z) for radius, z in round_profile(outside + inside)]
    return add_lathe("Goblet", profile, material, segments=96)


def instances():
    start_scene(world=(0.05, 0.06, 0.08))
    add_floor(8.0, diffuse("Floor", (0.5, 0.5, 0.5)))
    props = [make_cup(), make_knob(), make_marker()]
    scatter_collections(props, count=14, step=0.2)
    scatter_by_nodes(make_pearl())
    add_vertex_instances()
    add_title()
    add_lamp("AREA", (1.5, -1.0, 2.6), (0, 0, 0), 110.0, size=0.8)
    add_lamp("POINT", (-1.3, 0.6, 0.9), (0, 0, 0), 14.0, shadow_soft_size=0.03)
    add_camera((0.0, -3.3, 1.9), (0.0, -0.25, 0.0), lens=46.0)


def make_prop(name):
    """A collection that is rendered only through its instances."""
    return bpy.data.collections.new(name)


def make_cup():
    prop = make_prop("Cup")
    cup = [(0.0, 0.0), (0.04, 0.0), (0.05, 0.09), (0.045, 0.09), (0.036, 0.006), (0.0, 0.006)]
    add_lathe("Cup", cup, principled("Glaze", (0.1, 0.25, 0.6), Roughness=0.15), 24, False, prop)
    clay = principled("Clay", (0.5, 0.2, 0.1), Roughness=0.6)
    handle = add_box("Handle", (0.06, 0.0, 0.05), (0.05, 0.012, 0.05), clay, collection=prop)
    handle.rotation_euler.y = 0.2
    return prop


def make_knob():
    prop = make_prop("Knob")
    add_sphere("Ball", (0.0, 0.0, 0.05), 0.05, metal("Copper", (0.93, 0.55, 0.4), 0.15), 32, 16, prop)
    add_sphere("Bead", (0.055, 0.0, 0.022), 0.02, glass("Bead", 1.45), 32, 16, prop)
    return prop


def make_marker():
    """One mesh of two materials, without any symmetry: a mirrored instance shows at once."""
    prop = make_prop("Marker")
    marker = add_box("Marker", (0.0, 0.0, 0.03), (0.12, 0.04, 0.06), diffuse("Yellow", (0.7, 0.55, 0.05)), 0, prop)
    marker.data.materials.append(principled("Dark", (0.05, 0.05, 0.05), Roughness=0.4))
    marker.data.polygons[1].material_index = marker.data.polygons[3].material_index = 1
    add_box("Nose", (0.05, 0.02, 0.075), (0.02, 0.03, 0.05), marker.data.materials[1], 0, prop)
    return prop


def make_pearl():
    return add_sphere("Pearl", (0, 0, -1.0), 0.012, principled("Pearl", (0.8, 0.75, 0.7), Roughness=0.25), 16, 8)


def scatter_collections(props, count, step):
    """Count x count instances of whole collections; every third one is mirrored."""
    chance = random.Random(11)
    for index in range(count * count):
        row, column = divmod(index, count)
        empty = link(f"Instance {index:03}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", props[chance.randrange(len(props))]
        empty.location = ((column - (count - 1) / 2) * step, (row - (count - 1) / 2) * step, 0.0)
        empty.rotation_euler.z = chance.uniform(0, 2 * math.pi)
        size = chance.uniform(0.7, 1.2)
        empty.scale = (-size if index % 3 == 0 else size, size, size)


def scatter_by_nodes(pearl, count=21, size=2.9):
    """A grid of count x count pearls by geometry nodes."""
    tree = bpy.data.node_groups.new("Pearls", "GeometryNodeTree")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    nodes, links = tree.nodes, tree.links
    grid, place = nodes.new("GeometryNodeMeshGrid"), nodes.new("GeometryNodeInstanceOnPoints")
    source, output = nodes.new("GeometryNodeObjectInfo"), nodes.new("NodeGroupOutput")
    for socket, value in {"Size X": size, "Size Y": size, "Vertices X": count, "Vertices Y": count}.items():
        grid.inputs[socket].default_value = value
    source.inputs["Object"].default_value = pearl
    source.inputs["As Instance"].default_value = True
    links.new(grid.outputs["Mesh"], place.inputs["Points"])
    links.new(source.outputs["Geometry"], place.inputs["Instance"])
    links.new(place.outputs["Instances"], output.inputs["Geometry"])
    carrier = add_mesh("Pearls", [(0, 0, 0)], [], None)
    carrier.location.z = 0.012
    carrier.modifiers.new("Pearls", "NODES").node_group = tree


def add_vertex_instances():
    """A fence of posts: one child, instanced on the vertices of a curve of points."""
    angles = np.linspace(0.15 * math.pi, 0.85 * math.pi, 40)
    points = [(1.9 * math.cos(t), 1.9 * math.sin(t), 0.0) for t in angles]
    fence = add_mesh("Fence", points, [], None)
    fence.instance_type = "VERTS"
    post = add_lathe("Post", [(0.03, 0.0), (0.03, 0.3), (0.0, 0.36)], metal("Steel", (0.6, 0.6, 0.62), 0.3), 12, False)
    post.parent = fence


def add_title():
    """Text that was never turned into a mesh."""
    title = bpy.data.curves.new("Title", "FONT")
    title.body, title.size, title.extrude, title.align_x = "SPPM", 0.42, 0.03, "CENTER"
    title.materials.append(principled("Title", (0.6, 0.05, 0.05), Roughness=0.3))
    text = link("Title", title)
    text.location, text.rotation_euler = (0.0, -1.72, 0.02), (math.radians(75), 0.0, 0.0)


def dof_ortho():
    start_scene(world=(0.15, 0.17, 0.2))
    checker = node_material("Checker", "ShaderNodeBsdfDiffuse", {})
    add_floor_checker(3.0, 24, checker)
    colors = [(0.7, 0.1, 0.08), (0.7, 0.45, 0.05), (0.1, 0.5, 0.15), (0.08, 0.3, 0.65), (0.4, 0.1, 0.5)]
    centers = [(-0.36 + 0.18 * i, -0.6 + 0.3 * i, 0.1) for i in range(5)]
    for i, (color, center) in enumerate(zip(colors, centers)):
        material = glass("Glass", 1.5) if i == 3 else principled(f"Ball {i}", color, Roughness=0.3)
        add_sphere(f"Ball {i}", center, 0.1, material)
    add_lamp("AREA", (-1.0, -1.2, 1.8), (0, 0, 0), 60.0, size=0.3)
    camera = add_camera((0.0, -2.5, 1.6), (0.0, 0.0, 0.06))
    camera.type, camera.ortho_scale = "ORTHO", 1.25
    camera.dof.use_dof, camera.dof.aperture_fstop = True, 8.0
    camera.dof.focus_object = bpy.data.objects["Ball 2"]


def add_floor_checker(size, count, material):
    """A floor of count x count squares that carry their grey as a colour attribute."""
    axis = np.linspace(-size / 2, size / 2, count + 1)
    n = count + 1
    vertices = [(x, y, 0.0) for y in axis for x in axis]
    faces = [(r * n + c, r * n + c + 1, (r + 1) * n + c + 1, (r + 1) * n + c) for r in range(count) for c in range(count)]
    floor = add_mesh("Floor", vertices, faces, material)
    colors = floor.data.color_attributes.new("Squares", "FLOAT_COLOR", "CORNER")
    for polygon in floor.data.polygons:
        row, column = divmod(polygon.index, count)
        grey = 0.7 if (row + column) % 2 else 0.15
        for loop in polygon.loop_indices:
            colors.data[loop].color = (grey, grey, grey, 1.0)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    attribute = nodes.new("ShaderNodeVertexColor")
    attribute.layer_name, attribute.location.x = "Squares", -300
    links.new(attribute.outputs["Color"], nodes["Diffuse BSDF"].inputs["Color"])


def world():
    scene = start_scene()
    light_by_image(scene.world, pack_image("Sky", sky_pixels(), is_float=True), turn=25)
    add_floor(4.0, diffuse("Floor", (0.45, 0.43, 0.4)))
    materials = [
        diffuse("Chalk", (0.7, 0.7, 0.7)),
        principled("Plastic", (0.65, 0.08, 0.06), Roughness=0.2),
        metal("Brushed", (0.9, 0.75, 0.5), 0.3),
        metal("Chrome", (0.9, 0.9, 0.9)),
        glass("Glass"),
    ]
    places = [(-0.26, 0.1), (0.0, 0.14), (0.26, 0.1), (-0.14, -0.12), (0.14, -0.12)]
    for material, (x, y) in zip(materials, places):
        add_sphere(material.name, (x, y, 0.1), 0.1, material)
    add_camera((0.0, -1.05, 0.5), (0.0, 0.0, 0.09), lens=50.0)


def sky_pixels(width=256, height=128):
    """A made-up sky as radiance, latitude by longitude: bright blue above, brown ground, a sun of 3 degrees and a red window."""
    latitude = (np.arange(height) + 0.5) / height * math.pi - math.pi / 2
    longitude = (np.arange(width) + 0.5) / width * 2 * math.pi - math.pi
    lon, lat = np.meshgrid(longitude, latitude)
    up = np.clip(np.sin(lat), 0, 1)[..., None]
    sky = (1 - up) * np.array((0.75, 0.78, 0.8)) + up * np.array((0.18, 0.35, 0.75))
    pixels = np.where((lat < 0)[..., None], np.array((0.12, 0.1, 0.08)), sky) * 0.6
    sun_lat, sun_lon = math.radians(38), math.radians(-60)
    cosine = np.sin(lat) * math.sin(sun_lat) + np.cos(lat) * math.cos(sun_lat) * np.cos(lon - sun_lon)
    pixels[cosine > math.cos(math.radians(3))] += np.array((320.0, 290.0, 240.0))
    pixels[(abs(lon - 1.6) < 0.25) & (abs(lat - 0.5) < 0.2)] = (9.0, 2.5, 1.5)
    return pixels.astype(np.float32)


def wineglass_hdri():
    scene = start_scene()
    light_by_image(scene.world, pack_image("Clear sky", clear_sky_pixels(), is_float=True), turn=0)
    add_floor(10.0, diffuse("Floor", (0.55, 0.53, 0.5)))
    add_goblet(glass("Glass"), height=0.15).location.z = 0.0002
    add_camera((0.02, -0.45, 0.33), (-0.045, 0.03, 0.042), lens=50.0)


def clear_sky_pixels(width=1024, height=512):
    """A cloudless sky as radiance, latitude by longitude: one colour a row, and a sun of 1 degree that outshines it."""
    latitude = (np.arange(height) + 0.5) / height * math.pi - math.pi / 2
    longitude = (np.arange(width) + 0.5) / width * 2 * math.pi - math.pi
    lon, lat = np.meshgrid(longitude, latitude)
    haze = np.exp(-4.0 * np.clip(np.sin(lat), 0, 1))[..., None]
    sky = 0.12 * np.array((0.35, 0.6, 1.0)) + 0.1 * haze * np.array((1.0, 0.98, 0.95))
    pixels = np.where((lat < 0)[..., None], np.array((0.06, 0.055, 0.05)), sky)
    sun_lat, sun_lon = math.radians(42), math.radians(-35)
    cosine = np.sin(lat) * math.sin(sun_lat) + np.cos(lat) * math.cos(sun_lat) * np.cos(lon - sun_lon)
    pixels[cosine > math.cos(math.radians(0.5))] = (8800.0, 8300.0, 7500.0)
    return pixels.astype(np.float32)


def light_by_image(scene_world, image, turn):
    """An equirectangular image as the world's light, turned about z by degrees."""
    nodes, links = scene_world.node_tree.nodes, scene_world.node_tree.links
    coordinates, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    texture = nodes.new("ShaderNodeTexEnvironment")
    for place, node in zip((-900, -600, -300), (coordinates, mapping, texture)):
        node.location.x = place
    mapping.inputs["Rotation"].default_value[2] = math.radians(turn)
    texture.image = image
    links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Background"].inputs["Color"])


SCENES = (cornell_glass, cornell_diffuse, ring, pool, sun_glass, instances, dof_ortho, world, wineglass_hdri)


def main(names):
    unknown = set(names) - {scene.__name__ for scene in SCENES}
    if unknown:
        sys.exit(f"make_scenes: no such scene: {', '.join(sorted(unknown))}")
    for scene in SCENES:
        if not names or scene.__name__ in names:
            scene()
            save_scene(scene.__name__)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
