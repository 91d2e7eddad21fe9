"""What nodes of every kind need: their sockets, and what stands for an unknown node."""

from .material_params import ZERO, gray, rgb
from .scene_desc import Param


def by_identifier(sockets, identifier):
    return next((s for s in sockets if s.identifier == identifier), None)


def group_output(node, identifier):
    nodes = node.node_tree.nodes if node.node_tree else ()
    output = next((n for n in nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None)
    return by_identifier(output.inputs, identifier) if output else None


def default_of(socket) -> Param:
    value = getattr(socket, "default_value", 0.0)
    return rgb(value) if socket.type in ("RGBA", "VECTOR") else gray(value) if isinstance(value, (int, float)) else ZERO


def unknown_value(walk, node, out):
    """Passes the first colour input through; without one the consumer keeps its own value."""
    first = next((s for s in node.inputs if s.type == "RGBA" and s.enabled), None)
    walk.warn(node, "is not supported, " + ("its first colour is used" if first else "what it feeds keeps its own value"))
    return walk.value(first)[0] if first else None
