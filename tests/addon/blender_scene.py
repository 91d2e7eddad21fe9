"""Small scenes for tests, and the pixels of a render; the builders themselves are those of blend_scenes/make_scenes.py."""

import bpy
import make_scenes
import numpy as np
import pictures


def start(width, height, iterations=4, world=(0.0, 0.0, 0.0)):
    """A new, empty file for SPPM."""
    scene = make_scenes.start_scene(world)
    scene.render.engine = "SPPM"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.sppm.iterations = iterations
    return scene


def add_ball_on_floor():
    """A glass ball, 'Ball', on a white floor, a lamp and a camera that sees both; returns the ball."""
    make_scenes.add_floor(4.0, make_scenes.diffuse("White", make_scenes.WHITE))
    ball = make_scenes.add_sphere("Ball", (0, 0, 0.5), 0.4, make_scenes.glass("Glass"), 32, 16)
    make_scenes.add_lamp("POINT", (1, -1, 2), (0, 0, 0), 50.0, shadow_soft_size=0.05)
    make_scenes.add_camera((0, -4, 1), (0, 0, 0.5))
    return ball


def cube(name="Cube", material=None, smooth=False, collection=None):
    """A cube from -0.5 to 0.5."""
    made = make_scenes.add_box(name, (0, 0, 0), 1.0, material, collection=collection)
    made.data.polygons.foreach_set("use_smooth", [smooth] * 6)
    return made


def new_collection(name, is_linked=True):
    made = bpy.data.collections.new(name)
    if is_linked:
        bpy.context.scene.collection.children.link(made)
    return made


def add_curve():
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.1
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    spline.points[1].co = (1, 0, 0, 1)
    return make_scenes.link("Curve", curve)


def add_text():
    text = bpy.data.curves.new("Text", "FONT")
    text.body = "SPPM"
    return make_scenes.link("Text", text)


def add_surface():
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    return bpy.context.object


def make_dupli_verts(show_instancer):
    """A cube, 'Child', on each vertex of the floor, which is rendered itself only where `show_instancer` says so."""
    parent = make_scenes.add_floor(4.0, None)
    cube("Child").parent = parent
    parent.instance_type, parent.show_instancer_for_render = "VERTS", show_instancer


def render(path):
    """Renders as F12 does, to an OpenEXR file; (height, width, 4) float32, rows from bottom to top, linear."""
    settings = bpy.context.scene.render
    settings.image_settings.file_format = "OPEN_EXR"
    settings.image_settings.color_mode = "RGBA"
    settings.image_settings.color_depth = "32"
    settings.use_file_extension = True
    settings.filepath = str(path)
    path.unlink(missing_ok=True)
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    pixels = read(path)
    pictures.keep(pixels)
    return pixels


def read(path):
    """The pixels of an image file as they are stored."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, -1)


def region_means(pixels, count=4):
    """Mean colour of count x count equal parts: (count, count, 3)."""
    height, width, _ = pixels.shape
    parts = pixels[..., :3].reshape(count, height // count, count, width // count, 3)
    return parts.mean((1, 3), dtype=np.float64)


def save_side_by_side(path, ours, theirs, spread=0.1, zoom=4):
    """A PNG of two (height, width, 3) pictures and their ratio: red where ours is brighter, else blue, full at `spread`."""
    white = max(np.percentile(theirs, 98), 1e-9)
    tones = [np.clip(picture / white, 0, 1) ** (1 / 2.2) for picture in (ours, theirs)]
    dark = 1e-3 * white
    off = np.clip(((ours.sum(-1) + dark) / (theirs.sum(-1) + dark) - 1) / spread, -1, 1)
    ratio = np.stack([1 - np.maximum(-off, 0), 1 - np.abs(off), 1 - np.maximum(off, 0)], -1)
    pixels = np.concatenate([*tones, ratio], 1).repeat(zoom, 0).repeat(zoom, 1)
    image = bpy.data.images.new("Side by side", pixels.shape[1], pixels.shape[0])
    image.pixels.foreach_set(np.concatenate([pixels, np.ones_like(pixels[..., :1])], -1).astype(np.float32).ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
