"""A material whose node tree a test builds, and what the exporter makes of it."""

import bpy
import pytest
from sppm.compat_nodes import principled_input
from sppm.export_material import MaterialExporter
from sppm.material_params import ZERO
from sppm.scene_desc import ClosureFlags, SceneDesc

V2 = bpy.app.version >= (4, 0, 0)
OLD = ClosureFlags.NONE if V2 else ClosureFlags.SMOOTH_ALBEDO  # of all microfacets
GGX = ClosureFlags.NONE if V2 else ClosureFlags.SEPARABLE | OLD  # without multiple scattering
RED = (0.8, 0.2, 0.1, 1.0)


class Bench:
    """One material whose tree a test builds, and the exporter with its warnings."""

    def __init__(self):
        self.material = bpy.data.materials.new("Test")
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.node("OutputMaterial")
        self.scene, self.warnings = SceneDesc(), []
        self.exporter = MaterialExporter(self.scene, self.warnings.append, lambda image: 7)

    def node(self, name, tree=None, **inputs):
        node = (tree or self.tree).nodes.new(name if name.startswith(("Node", "Shader")) else f"ShaderNode{name}")
        for key, value in inputs.items():
            socket = principled_input(node, key.replace("_", " "))
            socket.default_value = value
        return node

    def link(self, out, socket, tree=None):
        (tree or self.tree).links.new(out, socket)

    def surface(self, node):
        self.link(node.outputs[0], self.output.inputs["Surface"])
        return node

    def export(self):
        self.id = self.exporter.export(self.material)
        return self.scene.materials[self.id - 1].closures

    def emitted(self, out):
        """The Param that `out` has as the colour of an Emission shader."""
        emission = self.surface(self.node("Emission"))
        self.link(out, emission.inputs["Color"])
        closures = self.export()
        return closures[0].color if closures else ZERO

    def texture(self, param):
        return self.scene.textures[param.texture - 1]

    def image(self):
        node = self.node("TexImage")
        node.image = bpy.data.images.new("picture", 2, 2)
        return node

    def mix(self, factor, first, second):
        """Mix Shader of two shader nodes; `factor` is a number or an output."""
        mix = self.surface(self.node("MixShader"))
        if isinstance(factor, float):
            mix.inputs[0].default_value = factor
        else:
            self.link(factor, mix.inputs[0])
        self.link(first.outputs[0], mix.inputs[1])
        self.link(second.outputs[0], mix.inputs[2])
        return mix


def types(closures):
    return [c.type.name for c in closures]


def close(a, b):
    return a == pytest.approx(b, abs=1e-5)
