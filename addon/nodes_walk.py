"""One material's node tree, from its output on: follows links, and asks each node's function for closures or values."""

from contextlib import contextmanager
from dataclasses import dataclass

import bpy
from mathutils import Matrix

from .material_params import ZERO, at_least_zero, in_unit, is_zero, luminance
from .nodes_color import COLOR_NODES
from .nodes_common import by_identifier, default_of, group_output, unknown_value
from .nodes_input import INPUT_NODES, fresnel_node_ior
from .nodes_math import MATH_NODES
from .nodes_shader import SHADERS, unknown_shader
from .nodes_vector import VECTORS, unknown_vector
from .scene_desc import Param, TextureDesc, TextureType

MAX_CLOSURES = 16
VALUES = {**INPUT_NODES, **COLOR_NODES, **MATH_NODES}


@dataclass
class Needs:
    """What a material reads from a mesh: names of its UV map and colours, '' the active one, None not at all."""

    uv_map: str | None = None
    colors: str | None = None


class Walk:
    """Follows links and keeps the stack of node groups it is in; `exporter` is the MaterialExporter that it is a part of."""

    def __init__(self, exporter, material: bpy.types.Material):
        self.exporter = exporter
        self.algebra = exporter.algebra
        self.material = material
        self.needs = Needs()
        self.stack = ()
        self.active = set()
        self.values = {}
        self.warned = set()

    def warn(self, node, text: str):
        where = f"Material '{self.material.name}'" + (f", node '{node.name}'" if node else "")
        if (where, text) not in self.warned:
            self.warned.add((where, text))
            self.exporter.warn(f"{where}: {text}")

    def surface(self) -> list:
        """Closures of the active output for Cycles."""
        output = self.material.node_tree.get_output_node("CYCLES")
        if output is None:
            return []
        for name in ("Volume", "Displacement"):
            if self.resolve(output.inputs[name])[0]:
                self.warn(output, f"{name.lower()} is not rendered")
        closures = self.closures(output.inputs["Surface"])
        if len(closures) > MAX_CLOSURES:
            self.warn(output, f"more than {MAX_CLOSURES} closures, the rest is left out")
        return closures[:MAX_CLOSURES]

    # -------------------------------------------------------- following links

    def resolve(self, socket):
        """What feeds the input `socket`: (output or None, input whose default counts, stack there)."""
        stack, end = self.stack, socket
        while socket.is_linked and not socket.links[0].is_muted:
            out = socket.links[0].from_socket
            node = out.node
            if node.mute:
                socket = next((i.from_socket for i in node.internal_links if i.to_socket == out), None)
                if socket is None:
                    return None, end, stack
            elif node.bl_idname == "NodeReroute":
                socket = node.inputs[0]
                continue  # an open reroute leaves the default of what it feeds
            elif node.bl_idname == "ShaderNodeGroup":
                inner = group_output(node, out.identifier)
                if inner is None:
                    return None, end, stack
                stack, socket = (*stack, node), inner
            elif node.bl_idname == "NodeGroupInput":
                outer = by_identifier(stack[-1].inputs, out.identifier) if stack else None
                if outer is None:
                    return None, end, stack
                stack, socket = stack[:-1], outer
            else:
                return out, end, stack
            end = socket
        return None, end, stack

    @contextmanager
    def at(self, node, stack):
        """Within `node`; gives False where that is a cycle."""
        key = (node.as_pointer(), tuple(g.as_pointer() for g in stack))
        if key in self.active:
            self.warn(node, "is part of a cycle")
            yield False
            return
        before, self.stack = self.stack, stack
        self.active.add(key)
        try:
            yield True
        finally:
            self.active.discard(key)
            self.stack = before

    def closures(self, socket) -> list:
        """The closures of what feeds a shader socket, without those of no weight."""
        out, _, stack = self.resolve(socket)
        if out is None:
            return []
        with self.at(out.node, stack) as fresh:
            if not fresh:
                return []
            function = SHADERS.get(out.node.bl_idname, unknown_shader)
            warn_of_normals(self, out.node)
            return [c for c in function(self, out.node) if not is_zero(c.weight)]

    # -------------------------------------------------------- reading values

    def value(self, socket):
        """(Param, socket type it came from) of what feeds `socket`."""
        out, end, stack = self.resolve(socket)
        if out is None:
            return default_of(end), end.type
        key = (out.node.as_pointer(), out.identifier, tuple(g.as_pointer() for g in stack))
        if key not in self.values:
            with self.at(out.node, stack) as fresh:
                self.values[key] = VALUES.get(out.node.bl_idname, unknown_value)(self, out.node, out) if fresh else None
        found = self.values[key]
        return (found, out.type) if found is not None else (default_of(socket), socket.type)

    def color(self, socket) -> Param:
        return at_least_zero(self.value(socket)[0])

    def signed(self, socket) -> Param:
        """A number, as grey."""
        p, kind = self.value(socket)
        if kind == "RGBA":
            return Param((luminance(p.value),) * 3, p.texture)
        if kind == "VECTOR":
            return Param((sum(p.value) / 3,) * 3, p.texture)
        return p

    def scalar(self, socket) -> Param:
        """A number from 0 to 1: factor, weight or roughness; absent sockets are 0."""
        return in_unit(self.signed(socket)) if socket else ZERO

    def number(self, socket) -> float:
        """A number that cannot vary over the surface."""
        p = self.signed(socket)
        if p.texture:
            self.warn(socket.node, f"'{socket.name}' cannot be textured, its own value is used")
            return default_of(socket).value[0]
        return p.value[0]

    def fresnel_ior(self, socket) -> float | None:
        """The index behind a Fresnel factor, None if the factor is something else."""
        out, _, stack = self.resolve(socket)
        if out is None or out.node.bl_idname not in ("ShaderNodeFresnel", "ShaderNodeLayerWeight") or out.name == "Facing":
            return None
        with self.at(out.node, stack) as fresh:
            return fresnel_node_ior(self, out.node) if fresh else None

    def use_uv_map(self, node, name: str):
        if self.needs.uv_map not in (None, name):
            self.warn(node, f"one UV map a material: '{self.needs.uv_map}' is used instead of '{name}'")
        elif self.needs.uv_map is None:
            self.needs.uv_map = name

    def use_colors(self, node, name: str) -> Param:
        if self.needs.colors not in (None, name):
            self.warn(node, f"one colour attribute a material: '{self.needs.colors}' is used instead of '{name}'")
        elif self.needs.colors is None:
            self.needs.colors = name
        return Param(texture=self.algebra.add(TextureDesc(TextureType.ATTRIBUTE)))

    def mapping(self, socket, unlinked: Matrix) -> Matrix:
        """The affine map from (u, v, 0) to the vector that feeds `socket`."""
        out, _, stack = self.resolve(socket)
        if out is None:
            return unlinked
        with self.at(out.node, stack) as fresh:
            function = VECTORS.get(out.node.bl_idname, unknown_vector) if fresh else unknown_vector
            return function(self, out.node, out)


def warn_of_normals(walk, node):
    for socket in node.inputs:
        if socket.name in ("Normal", "Clearcoat Normal", "Coat Normal", "Tangent") and walk.resolve(socket)[0]:
            walk.warn(node, f"'{socket.name}' (bump and normal maps) is not rendered")
