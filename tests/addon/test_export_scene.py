"""What the exporters read from Blender's evaluated scene; nothing is rendered.

Every export runs inside a render, where Blender evaluates for rendering: only there hide_render, render levels of modifiers and
the instancers' flags count.
"""

import math

import bpy
import make_scenes
import numpy as np
import pytest
from sppm import engine, export_scene, scene_desc, scene_validation
from sppm.scene_desc import InstanceFlags

DOWN = ((0, 0, 1.5), (0, 0, 0))


@pytest.fixture
def export(empty_scene, monkeypatch):
    """A function that exports the scene as a render would: (SceneDesc, warnings). Errors arrive as an operator's RuntimeError."""
    make_scenes.add_camera((0, -5, 3), (0, 0, 0))
    exported = []
    monkeypatch.setattr(engine._Render, "run", lambda self: exported.append(export_scene.export_scene(self._depsgraph)))

    def run():
        exported.clear()
        bpy.ops.render.render()
        desc, warnings = exported[0]
        scene_validation.validate(desc)
        return desc, warnings

    return run


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


def names(desc):
    return sorted(item.name for item in desc.instances)


def places(desc, name=None):
    """Sorted, rounded world positions of the instances."""
    items = [item for item in desc.instances if name in (None, item.name)]
    return sorted(tuple(float(v) for v in np.round(item.transform[:, 3] + desc.origin, 4) + 0.0) for item in items)


def material_names(desc, instance):
    return [desc.materials[index - 1].name if index else None for index in instance.materials]


# ---------------------------------------------------------------- objects that render


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


def add_metaball():
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new()
    return make_scenes.link("Ball", ball)


@pytest.mark.parametrize("add", [cube, add_curve, add_text, add_surface, add_metaball], ids=lambda add: add.__name__)
def test_object_becomes_triangles_once(export, add):
    made = add()
    name = made.name
    made.location = (1, 2, 3)
    desc, warnings = export()
    assert names(desc) == [name]
    assert len(desc.meshes) == 1
    assert len(desc.meshes[0].indices) >= 12
    assert places(desc) == [(1, 2, 3)]
    assert warnings == []


def test_mesh_without_faces_is_nothing(export):
    make_scenes.add_mesh("Points", [(0, 0, 0), (1, 0, 0)], [], None)
    desc, warnings = export()
    assert (desc.meshes, desc.instances, warnings) == ([], [], [])


def test_modifiers_have_their_render_level(export):
    modifier = cube().modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type, modifier.levels, modifier.render_levels = "SIMPLE", 0, 2
    assert len(export()[0].meshes[0].indices) == 6 * 16 * 2


def test_modifier_hidden_in_renders_is_not_applied(export):
    modifier = cube().modifiers.new("Array", "ARRAY")
    modifier.show_render = False
    assert len(export()[0].meshes[0].indices) == 12


@pytest.mark.parametrize("add, says", [
    (lambda: make_scenes.link("Cloud", bpy.data.volumes.new("Cloud")), "volume"),
    (lambda: make_scenes.link("Cloud", bpy.data.hair_curves.new("Cloud")), "hair"),
], ids=["volume", "hair curves"])
def test_what_cannot_be_rendered_is_named(export, add, says):
    add()
    desc, warnings = export()
    assert desc.instances == []
    assert len(warnings) == 1 and "'Cloud'" in warnings[0] and says in warnings[0]


def test_particle_hair_is_named_and_its_emitter_rendered(export):
    head = cube("Head")
    head.modifiers.new("Fur", "PARTICLE_SYSTEM")
    head.particle_systems[0].settings.type = "HAIR"
    desc, warnings = export()
    assert names(desc) == ["Head"]
    assert len(warnings) == 1 and "'Head'" in warnings[0] and "hair" in warnings[0]


# ---------------------------------------------------------------- instances


def test_linked_meshes_are_one_mesh(export):
    first = cube("First")
    make_scenes.link("Second", first.data).location = (2, 0, 0)
    desc, _ = export()
    assert names(desc) == ["First", "Second"]
    assert len(desc.meshes) == 1
    assert {item.mesh for item in desc.instances} == {1}


def test_collection_instances(export):
    """With a lamp in the collection: that is instanced as well."""
    source = new_collection("Source", is_linked=False)
    cube("Part", collection=source).location = (0, 0, 1)
    lamp = make_scenes.link("Lamp", bpy.data.lights.new("Lamp", "POINT"), source)
    lamp.data.energy = 10
    for x in (-2, 2, 4):
        empty = make_scenes.link(f"Empty{x}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, (x, 0, 0)
    desc, warnings = export()
    assert len(desc.meshes) == 1
    assert places(desc) == [(-2, 0, 1), (2, 0, 1), (4, 0, 1)]
    assert sorted(round(light.transform[0, 3]) for light in desc.lights) == [-2, 2, 4]
    assert warnings == []


def make_dupli_verts(show_instancer):
    parent = make_scenes.add_floor(4.0, None)
    cube("Child").parent = parent
    parent.instance_type, parent.show_instancer_for_render = "VERTS", show_instancer


@pytest.mark.parametrize("show_instancer", [False, True])
def test_instances_on_vertices(export, show_instancer):
    make_dupli_verts(show_instancer)
    desc, _ = export()
    assert places(desc, "Child") == [(-2, -2, 0), (-2, 2, 0), (2, -2, 0), (2, 2, 0)]
    assert len({item.mesh for item in desc.instances if item.name == "Child"}) == 1
    assert names(desc).count("Floor") == show_instancer
    assert len(desc.meshes) == 1 + show_instancer


@pytest.mark.parametrize("show_instancer", [False, True])
def test_instances_on_particles(export, show_instancer):
    bead = cube("Bead")
    bead.location = (20, 0, 0)
    emitter = make_scenes.add_floor(4.0, None)
    emitter.modifiers.new("Beads", "PARTICLE_SYSTEM")
    emitter.show_instancer_for_render = show_instancer
    settings = emitter.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 7, 0, 0, 100
    settings.render_type, settings.instance_object, settings.physics_type = "OBJECT", bead, "NO"
    bpy.context.scene.frame_set(2)
    desc, warnings = export()
    assert names(desc).count("Bead") == 8, "seven particles and the object itself"
    assert len({item.mesh for item in desc.instances if item.name == "Bead"}) == 1
    assert names(desc).count("Floor") == show_instancer
    assert warnings == []


def add_scatter(floor, source_type, **source_inputs):
    """A geometry node tree that puts what the source node makes on every vertex of the floor, and shows only that."""
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    if hasattr(tree, "interface"):
        for direction in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    else:
        tree.inputs.new("NodeSocketGeometry", "Geometry")
        tree.outputs.new("NodeSocketGeometry", "Geometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    source, scatter = tree.nodes.new(source_type), tree.nodes.new("GeometryNodeInstanceOnPoints")
    for name, value in source_inputs.items():
        source.inputs[name].default_value = value
    made = next(socket for socket in source.outputs if socket.type == "GEOMETRY")
    tree.links.new(start.outputs[0], scatter.inputs["Points"])
    tree.links.new(made, scatter.inputs["Instance"])
    tree.links.new(scatter.outputs["Instances"], end.inputs[0])
    floor.modifiers.new("Scatter", "NODES").node_group = tree


def test_geometry_nodes_instance_an_object(export):
    bead = cube("Bead")
    bead.location = (20, 0, 0)
    add_scatter(make_scenes.add_floor(4.0, None), "GeometryNodeObjectInfo", **{"Object": bead, "As Instance": True})
    desc, warnings = export()
    assert places(desc) == [(-2, -2, 0), (-2, 2, 0), (2, -2, 0), (2, 2, 0), (20, 0, 0)]
    assert len(desc.meshes) == 1
    assert warnings == []


def test_geometry_nodes_instance_their_own_meshes(export):
    """Two trees, whose meshes no object owns and which must not be taken for each other."""
    add_scatter(make_scenes.add_floor(4.0, None), "GeometryNodeMeshCube")
    add_scatter(make_scenes.add_floor(6.0, None), "GeometryNodeMeshUVSphere")
    desc, _ = export()
    assert sorted(len(mesh.indices) for mesh in desc.meshes) == [12, 32 * 15 * 2]
    by_distance = sorted(desc.instances, key=lambda item: abs(item.transform[0, 3]))
    assert [len(desc.meshes[item.mesh - 1].indices) for item in by_distance] == [12] * 4 + [32 * 15 * 2] * 4


@pytest.mark.parametrize("add", [add_curve, add_text, add_surface], ids=lambda add: add.__name__)
def test_instances_of_what_is_no_mesh(export, add):
    """Without metaballs: of those Blender makes no mesh unless they stand in the scene itself."""
    source = new_collection("Source", is_linked=False)
    made = add()
    for collection in made.users_collection:
        collection.objects.unlink(made)
    source.objects.link(made)
    for x in (-2, 2):
        empty = make_scenes.link(f"Empty{x}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, (x, 0, 0)
    desc, warnings = export()
    assert places(desc) == [(-2, 0, 0), (2, 0, 0)]
    assert len(desc.meshes) == 1
    assert warnings == []


def test_instances_in_instances(export):
    inner, outer = new_collection("Inner", is_linked=False), new_collection("Outer", is_linked=False)
    cube(collection=inner)
    for name, collection, place, source in (("A", outer, (0, 1, 0), inner), ("B", outer, (0, 2, 0), inner),
                                            ("C", None, (3, 0, 0), outer), ("D", None, (4, 0, 0), outer)):
        empty = make_scenes.link(name, None, collection)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, place
    desc, _ = export()
    assert places(desc) == [(3, 1, 0), (3, 2, 0), (4, 1, 0), (4, 2, 0)]
    assert len(desc.meshes) == 1


def test_negative_scale_stays_in_the_transform(export):
    cube().scale = (-2, 1, 0.5)
    transform = export()[0].instances[0].transform
    assert np.allclose(transform[:, :3], np.diag((-2, 1, 0.5)))


def test_scaled_to_nothing_is_left_out(export):
    cube().scale = (0, 0, 0)
    assert export()[0].instances == []


# ---------------------------------------------------------------- normals, UVs, slots


def corner_normals(desc):
    """(triangles, 3 corners, 3) normals and the same of the triangles' planes and of their corners' directions."""
    mesh = desc.meshes[0]
    points = mesh.positions[mesh.indices]
    planes = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    outward = points / np.linalg.norm(points, axis=2, keepdims=True)
    return mesh.corner_normals[mesh.corners], np.repeat(planes[:, None], 3, 1), outward


def make_normals_editable(mesh):
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi


def test_flat_mesh_stores_no_normals(export):
    cube()
    mesh = export()[0].meshes[0]
    assert mesh.corner_normals is None and mesh.corners is None


def test_smooth_mesh_has_normals_of_its_vertices(export):
    cube(smooth=True)
    normals, _, outward = corner_normals(export()[0])
    assert np.allclose(normals, outward, atol=1e-4)


def test_partly_smooth_mesh_is_flat_where_it_is_flat(export):
    cube(smooth=True).data.polygons[0].use_smooth = False
    normals, planes, _ = corner_normals(export()[0])
    same = np.isclose(normals, planes, atol=1e-4).all((1, 2))
    assert same.tolist() == [True] * 2 + [False] * 10


def test_sharp_edges_split_the_normals(export):
    """The top is cut off all around."""
    mesh = cube(smooth=True).data
    make_normals_editable(mesh)
    top = set(mesh.polygons[1].vertices)
    for edge in mesh.edges:
        edge.use_edge_sharp = top.issuperset(edge.vertices)
    normals, planes, _ = corner_normals(export()[0])
    same = np.isclose(normals, planes, atol=1e-4).all((1, 2))
    assert same.tolist() == [False] * 2 + [True] * 2 + [False] * 8


def test_custom_normals(export):
    mesh = cube(smooth=True).data
    make_normals_editable(mesh)
    wanted = np.array((0.6, 0.0, 0.8))
    mesh.normals_split_custom_set([tuple(wanted)] * len(mesh.loops))
    normals, _, _ = corner_normals(export()[0])
    assert np.allclose(normals, wanted, atol=1e-3)


def textured(name="Textured"):
    image = make_scenes.pack_image(name, np.full((2, 2, 3), 0.5, np.float32))
    return make_scenes.use_image(make_scenes.diffuse(name, (1, 1, 1)), image)


@pytest.mark.parametrize("is_needed", [False, True])
def test_uvs_are_exported_where_a_material_reads_them(export, is_needed):
    material = textured() if is_needed else make_scenes.diffuse("Plain", (1, 1, 1))
    make_scenes.add_quad("Quad", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), material, tiles=(3, 2))
    mesh = export()[0].meshes[0]
    if not is_needed:
        assert mesh.corner_uvs is None and mesh.corners is None
        return
    assert np.allclose(mesh.corner_uvs[mesh.corners], mesh.positions[mesh.indices][..., :2] * (3, 2))


def test_render_uv_map_is_used(export):
    quad = make_scenes.add_quad("Quad", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), textured(), tiles=(1, 1))
    other = quad.data.uv_layers.new(name="Other")
    for loop in other.data:
        loop.uv = (0.25, 0.75)
    other.active_render = True
    assert np.allclose(export()[0].meshes[0].corner_uvs, (0.25, 0.75))


@pytest.mark.parametrize("order", [("A plain", "B textured"), ("A textured", "B plain")])
def test_shared_mesh_has_uvs_if_any_instance_reads_them(export, order):
    """The slots are linked to the objects: the mesh itself does not know."""
    quad = make_scenes.add_quad("Quad", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), make_scenes.diffuse("Own", (1, 1, 1)), (1, 1))
    mesh = quad.data
    bpy.data.objects.remove(quad)
    for name in order:
        slot = make_scenes.link(name, mesh).material_slots[0]
        slot.link = "OBJECT"
        slot.material = textured(name) if "textured" in name else make_scenes.diffuse(name, (1, 1, 1))
    desc, _ = export()
    assert len(desc.meshes) == 1
    assert desc.meshes[0].corner_uvs is not None
    assert {item.name: material_names(desc, item) for item in desc.instances} == {name: [name] for name in order}


def test_material_slots(export):
    box = cube(material=make_scenes.diffuse("Red", (1, 0, 0)))
    for name in ("Green", "Blue"):
        box.data.materials.append(make_scenes.diffuse(name, (0, 1, 0)))
    box.data.polygons[1].material_index, box.data.polygons[2].material_index = 1, 2
    box.material_slots[1].link = "OBJECT"
    box.material_slots[1].material = make_scenes.diffuse("Mine", (1, 1, 1))
    desc, _ = export()
    assert material_names(desc, desc.instances[0]) == ["Red", "Mine", "Blue"]
    assert np.bincount(desc.meshes[0].material_slots).tolist() == [8, 2, 2]


def test_one_slot_is_not_stored(export):
    cube(material=make_scenes.diffuse("Red", (1, 0, 0)))
    assert export()[0].meshes[0].material_slots is None


def test_material_is_exported_once(export):
    red = make_scenes.diffuse("Red", (1, 0, 0))
    cube("First", red)
    cube("Second", red)
    desc, _ = export()
    assert len(desc.materials) == 1 and len(desc.meshes) == 2


# ---------------------------------------------------------------- what is hidden


def hide_object(scene, _collection):
    scene.objects["Hidden"].hide_render = True


def hide_collection(_scene, collection):
    collection.hide_render = True


def exclude_collection(scene, collection):
    scene.view_layers[0].layer_collection.children[collection.name].exclude = True


def hide_from_all_rays(scene, _collection):
    for ray in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(scene.objects["Hidden"], f"visible_{ray}", False)


@pytest.mark.parametrize("hide", [hide_object, hide_collection, exclude_collection, hide_from_all_rays], ids=lambda f: f.__name__)
def test_hidden(export, hide):
    collection = new_collection("Collection")
    cube("Shown")
    cube("Hidden", collection=collection)
    assert names(export()[0]) == ["Hidden", "Shown"]
    hide(bpy.context.scene, collection)
    desc, warnings = export()
    assert names(desc) == ["Shown"]
    assert warnings == []


def test_hidden_only_in_the_viewport_is_exported(export):
    box = cube()
    box.hide_viewport = True
    assert names(export()[0]) == ["Cube"]


def test_what_rays_cannot_be_told_is_said_once(export):
    """However many objects and instances there are."""
    make_dupli_verts(show_instancer=False)
    bpy.data.objects["Child"].visible_shadow = False
    for name in ("Second", "Third"):
        cube(name).visible_diffuse = False
    cube("Catcher").is_shadow_catcher = True
    desc, warnings = export()
    assert names(desc) == ["Catcher"] + ["Child"] * 4 + ["Second", "Third"]
    assert sorted(warnings) == [
        "object 'Catcher': a shadow catcher is rendered as an ordinary object",
        f"object '{desc.instances[0].name}' (and 2 more): ray visibility counts for camera rays only, all other rays see it"]


def hide_from_camera(thing, _layer_collection):
    thing.visible_camera = False


def make_indirect_only(_thing, layer_collection):
    layer_collection.indirect_only = True


def hold_out(thing, _layer_collection):
    thing.is_holdout = True


def hold_out_collection(_thing, layer_collection):
    layer_collection.holdout = True


def hold_out_and_make_indirect_only(_thing, layer_collection):
    layer_collection.holdout = layer_collection.indirect_only = True


CAMERA_SIGHTS = {hide_from_camera: InstanceFlags.HIDDEN_FROM_CAMERA, make_indirect_only: InstanceFlags.HIDDEN_FROM_CAMERA,
                 hold_out: InstanceFlags.HOLDOUT, hold_out_collection: InstanceFlags.HOLDOUT,
                 hold_out_and_make_indirect_only: InstanceFlags.HOLDOUT}


@pytest.mark.parametrize(("change", "flags"), CAMERA_SIGHTS.items(), ids=lambda value: getattr(value, "__name__", ""))
def test_how_the_camera_sees(export, change, flags):
    collection = new_collection("Collection")
    changed = cube("Changed", collection=collection)
    cube("Ordinary")
    change(changed, bpy.context.view_layer.layer_collection.children["Collection"])
    desc, warnings = export()
    assert {item.name: item.flags for item in desc.instances} == {"Changed": flags, "Ordinary": InstanceFlags.NONE}
    assert warnings == []


def test_what_an_instancer_says_counts_for_its_instances(export):
    make_dupli_verts(show_instancer=True)
    bpy.data.objects["Floor"].is_holdout = True
    bpy.data.objects["Child"].visible_camera = False
    bpy.data.objects["Child"].pass_index, bpy.data.objects["Floor"].pass_index = 3, 4
    desc, _ = export()
    both = InstanceFlags.HOLDOUT | InstanceFlags.HIDDEN_FROM_CAMERA
    assert {(item.name, item.flags, item.index) for item in desc.instances} == {
        ("Floor", InstanceFlags.HOLDOUT, 4), ("Child", both, 3)}


# ---------------------------------------------------------------- views


def test_stereoscopy_is_a_warning(export):
    bpy.context.scene.render.use_multiview = True
    assert any("stereoscopy" in warning for warning in export()[1])


# ---------------------------------------------------------------- origin


def test_near_scene_stays_where_it_is(export):
    cube().location = (1, 0, 0)
    make_scenes.add_floor(4.0, None)
    assert export()[0].origin == (0, 0, 0)


def test_far_scene_moves_to_its_centre(export):
    far = np.array((1e6, -2e6, 3e5))
    cube().location = far
    lamp = make_scenes.add_lamp("POINT", far + (0, 0, 2), far, 10.0)
    make_scenes.aim(bpy.context.scene.camera, far + (0, -5, 0), far)
    assert lamp.name == "Point"
    desc, _ = export()
    assert np.allclose(desc.origin, far, atol=1.0)
    for transform, offset in ((desc.instances[0].transform, (0, 0, 0)), (desc.lights[0].transform, (0, 0, 2)),
                              (desc.camera.transform, (0, -5, 0))):
        assert np.allclose(transform[:, 3] + desc.origin, far + offset, atol=1e-6)


def test_object_that_reaches_beyond_what_rays_do_is_named(export):
    """Told once for all such objects, and measured from where the scene has been moved to."""
    ground = make_scenes.add_floor(3e11, None)
    assert ground.name == "Floor"
    make_scenes.link("Second", ground.data)
    cube()
    _, warnings = export()
    assert len(warnings) == 1 and "'Floor' (and 1 more)" in warnings[0] and "1e+11 m" in warnings[0]
    ground.scale = bpy.data.objects["Second"].scale = (0.4, 0.4, 1)
    assert export()[1] == []
    ground.location = bpy.data.objects["Second"].location = bpy.data.objects["Cube"].location = (3e11, 0, 0)
    assert export()[1] == []


# ---------------------------------------------------------------- camera


@pytest.mark.parametrize("size", [(48, 32), (32, 48)], ids=["wide", "tall"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("lens_type", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("pixel_aspect", [1.0, 2.0])
def test_window_is_blenders_view_frame(export, size, fit, lens_type, pixel_aspect):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.pixel_aspect_y = pixel_aspect
    lens = scene.camera.data
    lens.type, lens.sensor_fit, lens.shift_x, lens.shift_y = lens_type, fit, 0.2, -0.1
    lens.sensor_width, lens.sensor_height, lens.lens, lens.ortho_scale = 30.0, 20.0, 45.0, 3.0
    camera = export()[0].camera
    corners = np.array([tuple(corner) for corner in lens.view_frame(scene=scene)])
    if lens_type == "PERSP":
        corners = corners / -corners[:, 2:]
    low, high = corners.min(0), corners.max(0)
    assert np.allclose(camera.window, (low[0], high[0], low[1], high[1]), atol=1e-5)
    assert (camera.width, camera.height) == size
    assert camera.projection == scene_desc.Projection[{"PERSP": "PERSPECTIVE", "ORTHO": "ORTHOGRAPHIC"}[lens_type]]


def test_camera_stands_where_it_stands_without_its_scale(export):
    before = export()[0].camera.transform
    bpy.context.scene.camera.scale = (2, 3, 4)
    assert np.allclose(export()[0].camera.transform, before, atol=1e-6)
    assert np.allclose(before[:, 3], (0, -5, 3))


def test_clipping_and_percentage(export):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 33, 21, 50
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.5, 70.0
    camera = export()[0].camera
    assert (camera.width, camera.height) == (16, 10)
    assert (camera.clip_near, camera.clip_far) == (0.5, 70.0)


@pytest.mark.parametrize("crop", [False, True])
def test_border_is_a_region(export, crop):
    render = bpy.context.scene.render
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 0.625
    render.use_crop_to_border = crop
    assert export()[0].camera.region is None
    render.use_border = True
    assert export()[0].camera.region == (8, 16, 16, 4)


@pytest.mark.parametrize("lens_type, focal_length", [("PERSP", 0.05), ("ORTHO", 1.0)])
def test_depth_of_field(export, lens_type, focal_length):
    lens = bpy.context.scene.camera.data
    lens.type, lens.lens = lens_type, 50.0
    lens.dof.aperture_fstop, lens.dof.focus_distance, lens.dof.aperture_ratio = 2.0, 3.0, 1.5
    assert export()[0].camera.aperture_radius == 0
    lens.dof.use_dof = True
    camera = export()[0].camera
    assert camera.aperture_radius == pytest.approx(focal_length / 4)
    assert (camera.focal_distance, camera.aperture_ratio) == (3.0, 1.5)


def test_focus_object_counts_along_the_view(export):
    camera = make_scenes.aim(bpy.context.scene.camera, (0, 0, 10), (0, 0, 0))
    target = make_scenes.link("Target", None)
    target.location = (3, 1, 4)
    camera.data.dof.use_dof, camera.data.dof.focus_object, camera.data.dof.aperture_blades = True, target, 5
    desc, warnings = export()
    assert desc.camera.focal_distance == pytest.approx(6.0)
    assert len(warnings) == 1 and "5 aperture blades" in warnings[0]


def test_panoramic_camera_is_refused_by_name(export):
    bpy.context.scene.camera.name = "Fisheye"
    bpy.context.scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match=r"'Fisheye' is panoramic"):
        export()


# ---------------------------------------------------------------- lamps


def exported_lamp(export, kind, **settings):
    lamp = make_scenes.add_lamp(kind, *DOWN, 10.0, **settings)
    lamp.data.color = (1.0, 0.5, 0.25)
    (light,), warnings = export()[0].lights, export()[1]
    assert warnings == []
    assert np.allclose(np.array(light.emission) / light.emission[0], (1.0, 0.5, 0.25))
    assert np.allclose(light.transform[:, 2], (0, 0, 1), atol=1e-6), "light goes along -z"
    assert np.allclose(light.transform[:, 3], DOWN[0])
    return light


def test_point_lamp(export):
    light = exported_lamp(export, "POINT", shadow_soft_size=0.25)
    assert (light.type, light.radius) == (scene_desc.LightType.POINT, 0.25)
    assert light.emission[0] == pytest.approx(10 / (4 * math.pi))


def test_spot_lamp(export):
    light = exported_lamp(export, "SPOT", shadow_soft_size=0.25, spot_size=1.0, spot_blend=0.5)
    assert (light.type, light.radius, light.blend) == (scene_desc.LightType.SPOT, 0.25, 0.5)
    assert light.angle == pytest.approx(1.0)
    assert light.emission[0] == pytest.approx(10 / (4 * math.pi))


def test_sun_lamp(export):
    light = exported_lamp(export, "SUN", angle=0.125)
    assert (light.type, light.angle) == (scene_desc.LightType.SUN, 0.125)
    cosine = math.cos(0.125 / 2)
    assert light.emission[0] == pytest.approx(10 if bpy.app.version >= (4, 0, 0) else 10 * 2 * cosine / (1 + cosine))


@pytest.mark.parametrize("shape, area", [("SQUARE", 4), ("RECTANGLE", 1), ("DISK", math.pi), ("ELLIPSE", math.pi / 4)])
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_area_lamp(export, shape, area, scale):
    """The power is that of the whole lamp, however it is scaled; Blender 3.4 divides by 4 A, later ones by pi A."""
    lamp = make_scenes.add_lamp("AREA", *DOWN, 10.0, shape=shape, size=2.0, size_y=0.5)
    lamp.scale = (scale, 1, 1)
    (light,) = export()[0].lights
    is_round = shape in ("DISK", "ELLIPSE")
    assert light.type == (scene_desc.LightType.ELLIPSE if is_round else scene_desc.LightType.RECTANGLE)
    assert (light.size_x, light.size_y) == (2.0, 0.5 if shape in ("RECTANGLE", "ELLIPSE") else 2.0)
    per_area = 4 if bpy.app.version < (4, 0, 0) else math.pi
    assert light.emission[0] == pytest.approx(10 / (per_area * area * scale))


@pytest.mark.parametrize("energy", [0.0, -5.0])
def test_lamp_without_light_is_left_out(export, energy):
    make_scenes.add_lamp("POINT", *DOWN, energy)
    desc, warnings = export()
    assert desc.lights == []
    assert len(warnings) == (energy < 0)


def test_world(export):
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1.0)
    background.inputs["Strength"].default_value = 2.0
    assert np.allclose(export()[0].world.radiance, (0.2, 0.4, 0.8))


def test_no_world_is_black(export):
    bpy.context.scene.world = None
    assert export()[0].world is None


@pytest.mark.skipif("exposure" not in bpy.types.Light.bl_rna.properties, reason="lamps have an exposure from Blender 4.5 on")
def test_exposure_temperature_and_normalisation_of_lamps(export):
    lamp = make_scenes.add_lamp("AREA", *DOWN, 10.0, shape="SQUARE", size=2.0).data
    usual = export()[0].lights[0].emission[0]
    lamp.exposure = 3.0
    assert export()[0].lights[0].emission[0] == pytest.approx(8 * usual)
    lamp.normalize = False
    assert export()[0].lights[0].emission[0] == pytest.approx(4 * 8 * usual), "as strong, of 4 square metres"
    lamp.use_temperature, lamp.temperature = True, 3000.0
    warm = export()[0].lights[0].emission
    assert warm[0] > warm[1] > warm[2]


def test_nodes_of_lamps(export):
    """A constant counts, anything else is named."""
    lamp = make_scenes.add_lamp("POINT", *DOWN, 10.0).data
    usual = export()[0].lights[0].emission[0]
    lamp.use_nodes = True
    emission = lamp.node_tree.nodes["Emission"]
    emission.inputs["Strength"].default_value = 3.0
    assert export()[0].lights[0].emission[0] == pytest.approx(3 * usual)
    body = lamp.node_tree.nodes.new("ShaderNodeBlackbody")
    body.inputs[0].default_value = 3000.0
    lamp.node_tree.links.new(body.outputs[0], emission.inputs["Color"])
    warm = export()[0].lights[0].emission
    assert warm[0] > warm[1] > warm[2]
    assert np.dot(warm, (0.2126, 0.7152, 0.0722)) == pytest.approx(3 * usual, rel=0.02), "of luminance 1"
    texture = lamp.node_tree.nodes.new("ShaderNodeTexNoise")
    lamp.node_tree.links.new(texture.outputs[0], emission.inputs["Strength"])
    assert any("'Point'" in warning and "Noise" in warning for warning in export()[1])


def test_sky_texture_is_named(export):
    tree = bpy.context.scene.world.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], tree.nodes["Background"].inputs["Color"])
    assert any("Sky Texture" in warning for warning in export()[1])
