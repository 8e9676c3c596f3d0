"""A scene of gltf.py as Mitsuba's, and images of it with one ray through the centre of each pixel."""

import os

import drjit as dr
import mitsuba as mi
import numpy as np
from gltf import Unsupported

# `LIGHTGRAPH_MITSUBA=cuda_ad_rgb` renders on a GPU.
mi.set_variant(os.environ.get("LIGHTGRAPH_MITSUBA", "llvm_ad_rgb"))

from image_files import decoded, memory_bitmap, read, values  # noqa: E402: reads the variant


class GltfSpot(mi.Emitter):
    """KHR_lights_punctual's spot: clamp((cosθ − cos outer)/max(0.001, cos inner − cos outer), 0, 1)², which Mitsuba's
    own `spot` (linear in the angle) is not."""

    def __init__(self, props):
        super().__init__(props)
        self.position = mi.Point3f(props["position"])
        self.axis = mi.Vector3f(props["direction"])
        self.intensity = mi.Color3f(props["intensity"])
        self.cos_outer = float(props["cos_outer"])
        self.width = max(float(props["cos_inner"]) - self.cos_outer, 0.001)
        self.m_flags = +mi.EmitterFlags.DeltaPosition

    def sample_direction(self, it, sample, active):
        d = self.position - it.p
        distance = dr.norm(d)
        ds = dr.zeros(mi.DirectionSample3f, dr.width(distance))
        ds.p = self.position
        ds.d = d / distance
        ds.n = -ds.d
        ds.dist = distance
        ds.pdf = 1.0
        ds.delta = True
        ds.emitter = mi.EmitterPtr(self)
        cone = dr.clip((-dr.dot(ds.d, self.axis) - self.cos_outer) / self.width, 0, 1)
        return ds, self.intensity * (dr.square(cone) / dr.square(distance)) & active

    def pdf_direction(self, it, ds, active):
        return mi.Float(0)

    def eval(self, si, active):
        return mi.Color3f(0)

    def bbox(self):
        return mi.ScalarBoundingBox3f()


mi.register_emitter("gltf_spot", GltfSpot)


def build(scene):
    """Mitsuba's scene, without a sensor."""
    d = {"type": "scene"}
    for i, l in enumerate(scene.lights):
        rgb = {"type": "rgb", "value": list(l.intensity)}
        if l.kind == "point":
            d[f"light{i}"] = {"type": "point", "position": l.position.tolist(), "intensity": rgb}
        elif l.kind == "directional":
            d[f"light{i}"] = {"type": "directional", "direction": l.direction.tolist(), "irradiance": rgb}
        else:
            d[f"light{i}"] = {
                "type": "gltf_spot",
                "position": l.position.tolist(),
                "direction": l.direction.tolist(),
                "intensity": l.intensity,
                "cos_inner": l.cos_inner,
                "cos_outer": l.cos_outer,
            }
    if scene.panorama is not None:
        d["environment"] = panorama(scene.panorama)
    for i, m in enumerate(scene.meshes):
        d[f"mesh{i}"] = shape(m, scene.materials[m.material])
    return mi.load_dict(d)


def panorama(path):
    """Light from all around. Mitsuba spreads a picture's rows from pole to pole, the first and last lying there: it gets
    a picture of many rows, each looked up where it will stand. Its middle is seen towards +Z, ours towards −Z."""
    image = read(path)
    height, width = image.shape[:2]
    rows = np.linspace(0, 1, max(height, 512) + 1) * height - 0.5
    image = np.concatenate([image[:1], image, image[-1:]])
    low = np.clip(np.floor(rows).astype(int), -1, height - 1)
    share = (rows - low)[:, None, None]
    image = (1 - share) * image[low + 1] + share * image[low + 2]
    turned = mi.ScalarTransform4f().rotate([0, 1, 0], 180)
    return {"type": "envmap", "bitmap": mi.Bitmap(image.astype(np.float32)), "to_world": turned}


def shape(m, material):
    props = mi.Properties()
    props["face_normals"] = m.normals is None
    props["bsdf"] = mi.load_dict(bsdf(material, m.colors is not None))
    if max(material.emission) > 0:
        radiance = {"type": "rgb", "value": material.emission}
        if material.glow is not None:
            radiance = bitmap(image_of(material.glow) * material.emission, material.glow)
        props["emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
    made = mi.Mesh(
        "mesh",
        len(m.positions),
        len(m.faces),
        props=props,
        has_vertex_normals=m.normals is not None,
        has_vertex_texcoords=m.uv is not None,
    )
    if m.colors is not None:
        made.add_attribute("vertex_color", 3, (m.colors * material.albedo).ravel().astype(np.float32))
    p = mi.traverse(made)
    p["vertex_positions"] = m.positions.ravel()
    p["faces"] = m.faces.ravel()
    if m.normals is not None:
        p["vertex_normals"] = m.normals.ravel()
    if m.uv is not None:
        p["vertex_texcoords"] = m.uv.ravel()
    p.update()
    return made


def bsdf(material, colored):
    """glTF's metallic-roughness model: of metalness m, m parts a metal and the rest matte."""
    reflectance = {"type": "rgb", "value": list(material.albedo)}
    if colored:
        reflectance = {"type": "mesh_attribute", "name": "vertex_color"}
        if material.picture is not None:
            raise Unsupported("pictures times vertex colours are not translated")
    elif material.picture is not None:
        reflectance = bitmap(image_of(material.picture) * np.array(material.albedo), material.picture)
    metallic, roughness = material.metallic, material.roughness
    if material.finish is not None:
        texels = image_of(material.finish, raw=True)
        metallic = bitmap(texels[..., 2:] * metallic, material.finish)
        roughness = bitmap(texels[..., 1:2] * roughness, material.finish)
    # GGX of the width roughness², Smith's shadowing, Schlick's Fresnel term from the base colour: glTF's own.
    metal = {"type": "principled", "base_color": reflectance, "metallic": 1.0, "roughness": roughness}
    found = {"type": "diffuse", "reflectance": reflectance}
    if metallic == 1.0:
        found = metal
    elif metallic != 0.0:
        found = {"type": "blendbsdf", "weight": metallic, "matte": found, "metal": metal}
    if material.normal is not None:
        # Neither of what Mitsuba can do about normals that turn away is glTF's.
        found = {
            "type": "normalmap",
            "normalmap": bitmap(image_of(material.normal, raw=True), material.normal),
            "flip_invalid_normals": False,
            "use_shadowing_function": False,
            "nested": found,
        }
    if material.double_sided:
        found = {"type": "twosided", "nested": found}
    if material.cutoff is not None:
        there = memory_bitmap(material.picture.data).convert(mi.Bitmap.PixelFormat.RGBA, mi.Struct.Type.Float32, srgb_gamma=False)
        if not material.picture.nearest:
            raise Unsupported("masks of means of texels are not translated")
        opacity = np.array(there)[..., 3:] >= material.cutoff
        found = {"type": "mask", "opacity": bitmap(opacity, material.picture), "nested": found}
    return found


def image_of(picture, raw=False):
    """A picture's texels, h × w × 3: linear light, or as they are."""
    return values(picture.data) if raw else decoded(picture.data)


def bitmap(texels, picture):
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(texels, dtype=np.float32)),
        "raw": True,
        "wrap_mode": "repeat",
        "filter_type": "nearest" if picture.nearest else "bilinear",
    }
