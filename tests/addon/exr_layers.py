"""Multilayer files as Blender writes them, read without Blender: its own reader gives one layer as an image, not its passes."""

import re

import bpy
import numpy as np


def render_layers(path):
    """Renders to a multilayer file: {"layer.pass": (height, width, channels)}, rows from bottom to top."""
    settings = bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    bpy.context.scene.render.filepath = str(path)
    assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    return read_layers(path.read_bytes())


def read_layers(data):
    """An uncompressed OpenEXR file of scan lines, with one part (up to Blender 4.5) or several."""
    is_multipart = bool(data[5] & 0x10)
    at, parts = 8, []
    while True:
        attributes, at = read_header(data, at)
        if not attributes:
            break
        parts.append(attributes)
        if not is_multipart:
            break
    counts = [height_of(part) for part in parts]
    offsets = np.frombuffer(data, "<u8", sum(counts), at)
    lines = {}
    for part, chunks in zip(parts, np.split(offsets, np.cumsum(counts)[:-1])):
        channels = [(name.decode(), kind) for name, kind in re.findall(rb"([^\0]+)\0(.\0{3}).{12}", part["channels"], re.DOTALL)]
        assert all(kind == b"\2\0\0\0" for _, kind in channels), "every channel is float"
        width = int(np.frombuffer(part["dataWindow"], "<i4")[2]) + 1
        rows = [np.frombuffer(data, "<f4", width * len(channels), int(at) + (12 if is_multipart else 8)) for at in chunks]
        pixels = np.stack(rows[::-1]).reshape(len(rows), len(channels), width)
        lines.update({name: pixels[:, index] for index, (name, _) in enumerate(channels)})
    return together(lines)


def read_header(data, at):
    attributes = {}
    while data[at]:
        name, kind, rest = data[at:at + 600].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size = int.from_bytes(data[at:at + 4], "little")
        attributes[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def height_of(part):
    _, low, _, high = np.frombuffer(part["dataWindow"], "<i4")
    return int(high - low) + 1


def together(channels):
    """Channels of the same layer and pass side by side, in the order RGBA, XYZ or UVA."""
    passes = {}
    for name in sorted(channels, key=lambda name: "RGBXYZUVA".index(name[-1])):
        passes.setdefault(name.rsplit(".", 1)[0], []).append(channels[name])
    return {name: np.stack(pixels, -1) for name, pixels in passes.items()}
