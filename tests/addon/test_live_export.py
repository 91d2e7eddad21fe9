"""What a viewport exports again after a change: only what has changed, and always what a render would export."""

from types import SimpleNamespace

import bpy
import make_scenes
import numpy as np
import pytest
from sppm import export_cache, export_image, export_scene, scene_change
from sppm.export_cache import ExportCache
from sppm.export_scene import export_viewport


class Viewport:
    """Exports as Blender tells of a change, and keeps what was read for it."""

    def __init__(self, monkeypatch):
        self.cache, self.scene, self.read = ExportCache(), None, set()
        for module, name, kind in ((export_scene, "export_mesh", "mesh"), (export_image, "_image_desc", "image")):
            monkeypatch.setattr(module, name, self._counted(getattr(module, name), kind, 0))
        read = export_cache.MaterialExporter.export
        monkeypatch.setattr(export_cache.MaterialExporter, "export", self._counted(read, "material", 1))

    def _counted(self, function, kind, position):
        def counted(*arguments):
            self.read.add(f"{kind} {getattr(arguments[position], 'name', None)}")
            return function(*arguments)

        return counted

    def update(self, _scene, depsgraph):
        self.scene = export_viewport(depsgraph, lambda obj: True, self.cache)

    def after(self, change):
        """What is read when something has changed; the export is then compared with one that knows nothing."""
        before, self.read = self.scene, set()
        change()
        bpy.context.view_layer.update()
        assert self.scene is not before, "Blender told of nothing"
        read, depsgraph = set(self.read), bpy.context.evaluated_depsgraph_get()
        check_same(self.scene, export_viewport(depsgraph, lambda obj: True, ExportCache()))
        return read


def check_same(cached, fresh):
    """The same scene, told by values and not by identity."""
    for name in ("textures", "materials"):
        assert getattr(cached, name) == getattr(fresh, name)
    for name in ("images", "meshes", "instances", "lights"):
        old, new = getattr(cached, name), getattr(fresh, name)
        assert len(old) == len(new) and all(map(scene_change.equal, old, new)), name
    assert scene_change.equal(cached.world, fresh.world)


@pytest.fixture
def viewport(empty_scene, monkeypatch):
    """Of a red floor with a picture on it, two boxes that share a mesh, a ball of glass and a lamp."""
    floor = make_scenes.diffuse("Picture", make_scenes.WHITE)
    make_scenes.use_image(floor, make_scenes.pack_image("Grey", np.full((8, 8, 3), 0.5)))
    make_scenes.add_quad("Floor", (-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), floor, tiles=(1, 1))
    box = make_scenes.add_box("Box", (1, 0, 0.5), (0.5, 0.5, 0.5), make_scenes.diffuse("Red", make_scenes.RED))
    make_scenes.link("Twin", box.data).location.y = 1.0
    make_scenes.add_sphere("Ball", (0, 0, 0.5), 0.4, make_scenes.glass("Glass"), 16, 8)
    make_scenes.add_lamp("POINT", (1, -1, 2), (0, 0, 0), 50.0)
    viewport = Viewport(monkeypatch)
    handlers = bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.frame_change_post
    for calls in handlers:
        calls.append(viewport.update)
    bpy.context.view_layer.update()
    viewport.after(lambda: bpy.data.objects["Ball"].update_tag())
    yield viewport
    for calls in handlers:
        calls.remove(viewport.update)


def socket(material, name):
    return next(node for node in bpy.data.materials[material].node_tree.nodes if node.type.startswith("BSDF")).inputs[name]


def test_all_is_read_at_first(viewport):
    viewport.cache = ExportCache()
    assert viewport.after(lambda: bpy.data.objects["Ball"].update_tag()) == {
        "mesh Floor", "mesh Box", "mesh Ball", "material Picture", "material Red", "material Glass", "image Grey"}


@pytest.mark.parametrize("change", [
    lambda: setattr(bpy.data.objects["Ball"], "location", (1, 1, 1)),
    lambda: setattr(bpy.data.lights["Point"], "energy", 80.0),
    lambda: setattr(bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"], "default_value", 2.0),
    lambda: setattr(bpy.data.objects["Twin"], "hide_viewport", True),
    lambda: bpy.data.objects.remove(bpy.data.objects["Twin"]),
], ids=["moved", "lamp", "world", "hidden", "removed"])
def test_nothing_is_read_where_only_places_and_lights_change(viewport, change):
    assert viewport.after(change) == set()


def test_nothing_shows_where_nothing_is_read(viewport):
    """A change of something else, as of a frame or the resolution, begins no picture again."""
    before = viewport.scene
    viewport.after(lambda: bpy.context.scene.update_tag())
    assert scene_change.is_unchanged(before, viewport.scene)


def test_changed_material_alone_is_read(viewport):
    assert viewport.after(lambda: setattr(socket("Red", "Color"), "default_value", (0, 0, 1, 1))) == {"material Red"}
    assert viewport.after(lambda: setattr(socket("Glass", "IOR"), "default_value", 1.2)) == {"material Glass"}


def test_changed_group_reads_the_materials(viewport):
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    value, end = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    if hasattr(group, "interface"):
        group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    else:
        group.outputs.new("NodeSocketColor", "Color")
    group.links.new(value.outputs[0], end.inputs[0])
    tree = bpy.data.materials["Red"].node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    viewport.after(lambda: tree.links.new(node.outputs[0], socket("Red", "Color")))
    assert "material Red" in viewport.after(lambda: setattr(value.outputs[0], "default_value", (0.1, 0.2, 0.3, 1.0)))


def test_changed_mesh_alone_is_read(viewport):
    def pull():
        bpy.data.meshes["Box"].vertices[0].co.z = -1.0
        bpy.data.meshes["Box"].update()

    assert viewport.after(pull) == {"mesh Box"}
    (read,) = viewport.after(lambda: bpy.data.objects["Ball"].modifiers.new("Sub", "SUBSURF"))
    assert read in ("mesh Ball", "mesh Mesh"), "since 4.5 what modifiers make is not named after the mesh"


def test_added_object_alone_is_read(viewport):
    red = bpy.data.materials["Red"]
    assert viewport.after(lambda: make_scenes.add_box("New", (0, 1, 0.2), (0.1, 0.1, 0.1), red)) == {"mesh New"}


def test_mesh_in_the_place_of_a_removed_one_is_read(viewport):
    """Memory is given out again: what counts is what Blender tells, not the address."""
    for turn in range(8):
        def swap():
            bpy.data.objects.remove(bpy.data.objects["Ball"])
            bpy.data.meshes.remove(bpy.data.meshes["Ball"])
            make_scenes.add_sphere("Ball", (0, 0, 0.5), 0.1 + 0.05 * turn, bpy.data.materials["Glass"], 16, 8)

        assert viewport.after(swap) == {"mesh Ball"}


def test_mesh_is_read_again_where_a_material_wants_more_of_it(viewport):
    def paint():
        bpy.data.objects["Ball"].data.uv_layers.new(name="UVMap")
        bpy.data.objects["Ball"].material_slots[0].material = bpy.data.materials["Picture"]

    viewport.after(paint)
    assert viewport.scene.meshes[-1].corner_uvs is not None


def test_geometry_nodes_are_read_where_they_change(viewport):
    tree = bpy.data.node_groups.new("Grow", "GeometryNodeTree")
    ball, end = tree.nodes.new("GeometryNodeMeshUVSphere"), tree.nodes.new("NodeGroupOutput")
    points, instances = tree.nodes.new("GeometryNodeMeshGrid"), tree.nodes.new("GeometryNodeInstanceOnPoints")
    if hasattr(tree, "interface"):
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    else:
        tree.outputs.new("NodeSocketGeometry", "Geometry")
    tree.links.new(points.outputs["Mesh"], instances.inputs["Points"])
    tree.links.new(ball.outputs["Mesh"], instances.inputs["Instance"])
    tree.links.new(instances.outputs[0], end.inputs[0])
    modifier = bpy.data.objects["Box"].modifiers.new("Nodes", "NODES")
    viewport.after(lambda: setattr(modifier, "node_group", tree))
    for radius in (0.3, 0.1, 0.2):
        viewport.after(lambda: setattr(ball.inputs["Radius"], "default_value", radius))
        sizes = [np.abs(mesh.positions).max() for mesh in viewport.scene.meshes]
        assert any(size == pytest.approx(radius) for size in sizes), sizes


def test_object_that_is_being_edited_is_there(viewport):
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    triangles = len(viewport.scene.meshes[-1].indices)
    viewport.after(lambda: bpy.ops.object.mode_set(mode="EDIT"))
    try:
        assert len(viewport.scene.meshes[-1].indices) == triangles
        bpy.ops.mesh.select_all(action="SELECT")
        viewport.after(lambda: bpy.ops.mesh.subdivide())
        assert len(viewport.scene.meshes[-1].indices) > triangles
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_frame_change_reads_what_is_animated(viewport):
    color = socket("Red", "Color")
    for frame, value in ((1, 0.0), (2, 1.0)):
        color.default_value[0] = value
        color.keyframe_insert("default_value", index=0, frame=frame)
    viewport.after(lambda: bpy.context.scene.frame_set(1))
    assert viewport.after(lambda: bpy.context.scene.frame_set(2)) == {"material Red"}


def test_changed_image_is_read_with_its_materials(viewport):
    image = bpy.data.images["Grey"]
    assert viewport.after(lambda: image.update_tag()) == {"image Grey", "material Picture"}
    assert {"image Grey"} <= viewport.after(lambda: setattr(image.colorspace_settings, "name", "Non-Color"))
    assert not viewport.scene.images[0].srgb


def test_all_is_forgotten_where_blender_does_not_tell_what_has_changed(viewport):
    """As at first, and after some changes of settings that images have."""
    assert viewport.cache.meshes and viewport.cache.materials and viewport.cache.images
    viewport.cache.forget_changes(SimpleNamespace(updates=(), as_pointer=lambda: 1))
    assert not (viewport.cache.meshes or viewport.cache.materials or viewport.cache.images)


def test_what_is_not_shown_is_not_exported(viewport):
    scene = export_viewport(bpy.context.evaluated_depsgraph_get(), lambda obj: obj.name != "Ball", viewport.cache)
    assert [item.name for item in scene.instances] == ["Floor", "Box", "Twin"]


def test_viewport_needs_no_camera_and_is_moved_to_its_centre(viewport):
    for obj in bpy.data.objects:
        obj.location.x += 1000.0
    viewport.after(lambda: None)
    assert viewport.scene.camera is None
    assert viewport.scene.origin[0] == pytest.approx(1000.0, abs=3.0)
    assert np.abs(viewport.scene.instances[0].transform[0, 3]) < 3.0
