"""Arithmetic of Params, in constants where it can be, else in textures of the scene."""

from .scene_desc import Blend, Param, SceneDesc, TextureDesc, TextureType

ZERO, ONE = Param((0.0, 0.0, 0.0)), Param()


def gray(x: float) -> Param:
    return Param((float(x),) * 3)


def rgb(values) -> Param:
    return Param(tuple(float(v) for v in values[:3]))


def luminance(c) -> float:
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]


def is_zero(p: Param) -> bool:
    return not any(p.value)


def at_least_zero(p: Param) -> Param:
    return Param(tuple(max(v, 0.0) for v in p.value), p.texture)


def in_unit(p: Param) -> Param:
    return Param(tuple(min(max(v, 0.0), 1.0) for v in p.value), p.texture)


BLENDS = {
    Blend.MIX: lambda a, b: b,
    Blend.MULTIPLY: lambda a, b: a * b,
    Blend.ADD: lambda a, b: a + b,
    Blend.SUBTRACT: lambda a, b: a - b,
    Blend.SCREEN: lambda a, b: 1 - (1 - a) * (1 - b),
    Blend.DIFFERENCE: lambda a, b: abs(a - b),
    Blend.DARKEN: min,
    Blend.LIGHTEN: max,
}


class TextureAlgebra:
    """Arithmetic of Params: folds constants, and adds textures to the scene (each only once) for the rest."""

    def __init__(self, scene: SceneDesc):
        self.scene = scene
        self.ids = {}

    def add(self, desc: TextureDesc) -> int:
        if desc not in self.ids:
            self.scene.textures.append(desc)
            self.ids[desc] = len(self.scene.textures)
        return self.ids[desc]

    def id_of(self, p: Param) -> int:
        """A texture that is the whole of `p`."""
        if p.texture and p.value == (1.0, 1.0, 1.0):
            return p.texture
        constant = self.add(TextureDesc(TextureType.CONSTANT, value=p.value))
        return self.multiply_textures(constant, p.texture) if p.texture else constant

    def multiply_textures(self, a: int, b: int) -> int:
        return self.add(TextureDesc(TextureType.MIX, blend=Blend.MULTIPLY, a=a, b=b, factor=self.id_of(ONE)))

    def multiply(self, a: Param, b: Param) -> Param:
        texture = self.multiply_textures(a.texture, b.texture) if a.texture and b.texture else a.texture or b.texture
        return Param(tuple(x * y for x, y in zip(a.value, b.value)), texture)

    def blend(self, blend: Blend, a: Param, b: Param, factor: Param = ONE) -> Param:
        """a (1 - factor) + blend(a, b) factor."""
        if is_zero(factor):
            return a
        if not (a.texture or b.texture or factor.texture):
            f = min(max(factor.value[0], 0.0), 1.0)
            return Param(tuple(x + (BLENDS[blend](x, y) - x) * f for x, y in zip(a.value, b.value)))
        if factor == ONE and blend is Blend.MIX:
            return b
        if factor == ONE and blend is Blend.MULTIPLY:
            return self.multiply(a, b)
        ids = {"a": self.id_of(a), "b": self.id_of(b), "factor": self.id_of(factor)}
        return Param(texture=self.add(TextureDesc(TextureType.MIX, blend=blend, **ids)))

    def one_minus(self, p: Param) -> Param:
        return self.blend(Blend.SUBTRACT, ONE, p)

    def clamp(self, p: Param, low: Param = ZERO, high: Param = ONE) -> Param:
        return self.blend(Blend.DARKEN, self.blend(Blend.LIGHTEN, p, low), high)
