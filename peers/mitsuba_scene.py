"""A scene of gltf.py as Mitsuba's, and images of it with one ray through the centre of each pixel."""

import drjit as dr
import mitsuba as mi
from gltf import Unsupported

mi.set_variant("llvm_ad_rgb")

from image_files import memory_bitmap  # noqa: E402: reads the variant


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
    for i, m in enumerate(scene.meshes):
        d[f"mesh{i}"] = shape(m, scene.materials[m.material])
    return mi.load_dict(d)


def shape(m, material):
    props = mi.Properties()
    props["face_normals"] = m.normals is None
    props["bsdf"] = mi.load_dict(bsdf(material))
    if max(material.emission) > 0:
        radiance = {"type": "rgb", "value": material.emission}
        props["emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
    made = mi.Mesh(
        "mesh",
        len(m.positions),
        len(m.faces),
        props=props,
        has_vertex_normals=m.normals is not None,
        has_vertex_texcoords=m.uv is not None,
    )
    p = mi.traverse(made)
    p["vertex_positions"] = m.positions.ravel()
    p["faces"] = m.faces.ravel()
    if m.normals is not None:
        p["vertex_normals"] = m.normals.ravel()
    if m.uv is not None:
        p["vertex_texcoords"] = m.uv.ravel()
    p.update()
    return made


def bsdf(material):
    reflectance = {"type": "rgb", "value": list(material.albedo)}
    if material.picture is not None:
        if list(material.albedo) != [1, 1, 1]:
            raise Unsupported("pictures times a colour are not translated")
        reflectance = {"type": "bitmap", "bitmap": memory_bitmap(material.picture), "wrap_mode": "repeat"}
    diffuse = {"type": "diffuse", "reflectance": reflectance}
    if material.metal is not None:
        # GGX of the width roughness², Smith's shadowing, Schlick's Fresnel term from the base colour: glTF's own.
        diffuse = {"type": "principled", "base_color": reflectance, "metallic": 1.0, "roughness": material.metal}
    return {"type": "twosided", "nested": diffuse} if material.double_sided else diffuse
