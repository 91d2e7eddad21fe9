"""SceneDesc -> mitsuba's scene dict, for the variant of mitsuba that is set.

Its pixel filter is a Gaussian of the standard deviation of our Blackman-Harris filter. Lamps are surfaces of the null material,
which lets all other light pass, as ours do.
"""

import math

import mitsuba as mi
import numpy as np
from jobs import CannotExpressError
from sppm.scene_desc import ClosureType, LightType, Projection, TextureType

_FILTER_DEVIATION = 0.1385 * 3.0  # pixels: a Blackman-Harris window that reaches 1.5 pixels to either side
_FACE_DOWN = np.diag((1.0, -1.0, -1.0, 1.0))  # ours shine along -z, mitsuba's rectangle along +z


def scene_dict(desc, integrator, folder):
    """What `mitsuba.load_dict` takes.

    Args:
        integrator: its dict.
        folder: where mesh files go; mitsuba reads them while it loads.

    Raises:
        CannotExpressError: the scene has something that mitsuba has not.
    """
    scene = {"type": "scene", "integrator": integrator, "sensor": _sensor(desc.camera)}
    for index, instance in enumerate(desc.instances):
        scene.update(_shapes(desc, instance, f"shape{index}", folder))
    scene.update((f"light{index}", _light(light)) for index, light in enumerate(desc.lights))
    if desc.world and any(desc.world.radiance):
        if desc.world.image:
            raise CannotExpressError("an environment image")
        scene["world"] = {"type": "constant", "radiance": _rgb(desc.world.radiance)}
    return scene


def _sensor(camera):
    left, right, bottom, top = camera.window
    if camera.projection != Projection.PERSPECTIVE or camera.aperture_radius > 0 or left != -right or bottom != -top:
        raise CannotExpressError("a camera that is not a centred pinhole")
    # Mitsuba's camera looks along +z and has +x on the left.
    return {"type": "perspective", "fov": math.degrees(2 * math.atan(right)), "fov_axis": "x",
            "near_clip": max(camera.clip_near, 1e-3), "far_clip": camera.clip_far,
            "to_world": _matrix(_square(camera.transform) @ np.diag((-1.0, 1.0, -1.0, 1.0))),
            "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height, "pixel_format": "rgb",
                     "rfilter": {"type": "gaussian", "stddev": _FILTER_DEVIATION}},
            "sampler": {"type": "independent"}}


def _square(transform):
    return np.vstack((transform, (0.0, 0.0, 0.0, 1.0)))


def _matrix(square):
    return mi.ScalarTransform4f(np.ascontiguousarray(square, np.float64))


def _rgb(values):
    return {"type": "rgb", "value": [float(v) for v in values]}


# ---------------------------------------------------------------- lamps


def _light(light):
    """One lamp; `hide_emitters` of the integrator keeps it from the camera."""
    frame, surface = _square(light.transform), {"bsdf": {"type": "null"}}
    if light.type == LightType.POINT and light.radius == 0:
        return {"type": "point", "position": list(frame[:3, 3]), "intensity": _rgb(light.emission)}
    if light.type == LightType.POINT:
        radiance = np.array(light.emission) / (math.pi * light.radius**2)
        return {"type": "sphere", "center": list(frame[:3, 3]), "radius": light.radius, **surface, "emitter": _area(radiance)}
    if light.type in (LightType.RECTANGLE, LightType.ELLIPSE):
        shape = "rectangle" if light.type == LightType.RECTANGLE else "disk"
        place = frame @ _FACE_DOWN @ np.diag((light.size_x / 2, light.size_y / 2, 1.0, 1.0))
        return {"type": shape, "to_world": _matrix(place), **surface, "emitter": _area(light.emission)}
    raise CannotExpressError(f"a lamp of type {LightType(light.type).name}")


def _area(radiance):
    return {"type": "area", "radiance": _rgb(radiance)}


# ---------------------------------------------------------------- surfaces


def _shapes(desc, instance, name, folder):
    """The instance's mesh, a shape for each material that it uses."""
    mesh = desc.meshes[instance.mesh - 1]
    slots = np.zeros(len(mesh.indices), np.uint32) if mesh.material_slots is None else mesh.material_slots
    for slot in np.unique(slots):
        path = folder / f"{name}-{slot}.ply"
        _write_ply(path, mesh, instance.transform, slots == slot)
        material = desc.materials[instance.materials[slot] - 1]
        yield f"{name}_{slot}", {"type": "ply", "filename": str(path), "face_normals": mesh.corner_normals is None,
                                 "bsdf": _bsdf(desc, material)}


def _write_ply(path, mesh, transform, chosen):
    """Chosen triangles in world space, each with three vertices of its own."""
    rotation = transform[:, :3]
    positions = mesh.positions[mesh.indices[chosen]].reshape(-1, 3) @ rotation.T + transform[:, 3]
    columns = dict(zip("xyz", positions.T))
    corners = None if mesh.corners is None else mesh.corners[chosen].ravel()
    if mesh.corner_normals is not None:
        normals = mesh.corner_normals[corners] @ np.linalg.inv(rotation)
        columns.update(zip(("nx", "ny", "nz"), (normals / np.linalg.norm(normals, axis=1, keepdims=True)).T))
    if mesh.corner_uvs is not None:
        columns.update(zip("uv", mesh.corner_uvs[corners].T))
    count = len(columns["x"])
    vertices = np.stack(list(columns.values()), -1).astype("<f4")
    order = np.arange(count, dtype="<i4").reshape(-1, 3)
    # A mirroring transform turns triangles inside out.
    order = order[:, ::-1] if np.linalg.det(rotation) < 0 else order
    faces = np.empty(len(order), [("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, order
    header = ["ply", "format binary_little_endian 1.0",
              f"element vertex {count}", *(f"property float {name}" for name in columns),
              f"element face {len(faces)}", "property list uchar int vertex_index", "end_header", ""]
    path.write_bytes("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())


def _bsdf(desc, material):
    if len(material.closures) != 1:
        raise CannotExpressError(f"material {material.name}: {len(material.closures)} closures")
    closure, = material.closures
    smooth = not any(closure.roughness.value[:1])
    color = _color(desc, closure.color)
    if closure.type == ClosureType.DIFFUSE:
        return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": color}}
    if closure.type == ClosureType.DIELECTRIC and smooth:
        return {"type": "dielectric", "int_ior": closure.ior, "ext_ior": 1.0, "specular_reflectance": color,
                "specular_transmittance": _color(desc, closure.color2)}
    if closure.type == ClosureType.CONDUCTOR and smooth and np.ptp((*closure.color.value, *closure.color2.value)) < 0.1:
        # Mitsuba's perfect mirror has no Schlick term: allowed where that says next to nothing.
        return {"type": "twosided", "bsdf": {"type": "conductor", "material": "none", "specular_reflectance": color}}
    raise CannotExpressError(f"material {material.name}: {ClosureType(closure.type).name}")


def _color(desc, param):
    if not param.texture:
        return _rgb(param.value)
    texture = desc.textures[param.texture - 1]
    if texture.type != TextureType.IMAGE or tuple(param.value) != (1.0, 1.0, 1.0) or texture.mapping is not None:
        raise CannotExpressError("a texture that is more than an image")
    image = desc.images[texture.image - 1]
    pixels = np.ascontiguousarray(image.pixels[::-1, :, :3])
    return {"type": "bitmap", "bitmap": mi.Bitmap(pixels), "raw": not image.srgb, "wrap_mode": "repeat"}
