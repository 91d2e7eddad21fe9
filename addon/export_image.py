"""Blender images -> ImageDesc, each once."""

import numpy as np

from .scene_desc import ImageDesc

_LINEAR_SPACES = ("Non-Color", "Raw", "Linear", "Linear Rec.709", "Generic Data")


class ImageExporter:
    """Appends images to a SceneDesc, each once.

    Args:
        known: address -> ImageDesc of those that need not be read; gets what is read.
    """

    def __init__(self, scene_desc, warn, known):
        self._images, self._warn, self._known, self.ids = scene_desc.images, warn, known, {}

    def export(self, image):
        """The id of a bpy image; a missing one warns and is magenta."""
        original = image.original or image
        key = original.as_pointer()
        if key not in self._known:
            self._known[key] = _image_desc(original, self._warn)
        return self.add(key)

    def add(self, key):
        """The id of a known image, by its address."""
        if key not in self.ids:
            self._images.append(self._known[key])
            self.ids[key] = len(self._images)
        return self.ids[key]


def _image_desc(image, warn):
    if image.source in ("TILED", "MOVIE", "SEQUENCE"):
        warn(f"image '{image.name}': of a {image.source.lower()} image only one picture is used")
    pixels = _read_pixels(image)
    if pixels is None:
        warn(f"image '{image.name}': its file '{image.filepath}' cannot be read, magenta is shown")
        return ImageDesc(image.name, np.array([[[1, 0, 1, 1]]], dtype=np.float32))
    return ImageDesc(image.name, _straight_alpha(pixels, image), _is_srgb(image, warn))


def _read_pixels(image):
    """(height, width, 4) float32, bottom row first, or None."""
    width, height = image.size
    channels = image.channels
    if width * height * channels == 0 or len(image.pixels) != width * height * channels:
        return None
    pixels = np.empty(width * height * channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    return _to_rgba(pixels.reshape(height, width, channels))


def _to_rgba(pixels):
    height, width, channels = pixels.shape
    if channels == 4:
        return pixels
    rgba = np.ones((height, width, 4), dtype=np.float32)
    rgba[..., :3] = pixels[..., :3] if channels == 3 else pixels[..., :1]
    return rgba


def _straight_alpha(pixels, image):
    """Float pictures are premultiplied where they say so, byte ones never; bytes go back to bytes, a quarter of the memory."""
    if image.alpha_mode == "NONE":
        pixels[..., 3] = 1.0
    elif image.is_float and image.alpha_mode == "PREMUL":
        alpha = pixels[..., 3:]
        pixels[..., :3] /= np.where(alpha > 0.0, alpha, 1.0)
    if image.is_float:
        # A few files hold infinities or NaN, which no renderer can use.
        return np.nan_to_num(pixels, nan=0.0, posinf=65504.0, neginf=0.0)
    return np.rint(np.clip(pixels, 0.0, 1.0) * 255.0).astype(np.uint8)


def _is_srgb(image, warn):
    """Float buffers are linear already; byte buffers keep the encoding of their file."""
    name = image.colorspace_settings.name
    if image.is_float or name in _LINEAR_SPACES or getattr(image.colorspace_settings, "is_data", False):
        return False
    if name != "sRGB":
        warn(f"image '{image.name}': colour space {name} is read as sRGB")
    return True
