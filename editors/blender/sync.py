"""From Blender's dependency graph to content, reading again only what it says has changed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy
import lightgraph as lg
import numpy as np

from . import materials, meshes, textures, units
from .content import Content, Lamp, upright

# The textures of a material.
TEXTURES = ("color_texture", "emission_texture", "finish_texture", "normal_texture", "coat_normal_texture")

# The sun's angle in the sky, as a new sun of Blender's has it.
SUN_ANGLE = 0.0092

_MESHED = {"MESH", "CURVE", "SURFACE", "META", "FONT"}
_UNKNOWN = {"VOLUME": "a volume", "CURVES": "hair", "POINTCLOUD": "a point cloud", "GREASEPENCIL": "a drawing"}


class Sync:
    """What was read so far. One for each view and for the final render."""

    def __init__(self) -> None:
        self.content = Content()
        self.notices: list[str] = []
        # By mesh in Blender's memory, with what tells it from another at its place.
        self._meshes: dict[tuple, list[meshes.Part]] = {}
        self._shapes: dict[tuple, tuple[tuple[lg.Mesh, ...], tuple]] = {}
        self._materials: dict[str, tuple[lg.Material, list[str]]] = {}
        self._images: dict[tuple, np.ndarray] = {}
        self._panorama: tuple[Any, Any] = (None, None)
        self._stale = True

    def forget(self) -> None:
        """Reads everything again next time, as after undo or another file. What comes out the same stays the same."""
        self._stale = True

    def read(self, depsgraph: bpy.types.Depsgraph, everything: bool = False, space: Any = None) -> Content:
        """The content as it is now. `everything`: don't trust what the dependency graph says has changed. `space`: the
        3D view that shows it, for what is hidden there alone."""
        all_of_it = everything or self._stale
        self._stale = False
        self._said: dict[str, None] = {}
        objects, data, shading = _changes(depsgraph, self._images)
        if all_of_it:
            self._images.clear()
        if all_of_it or shading:
            self._reread_materials()
        read: dict[tuple, list[meshes.Part]] = {}
        shapes: dict[str, tuple[lg.Mesh, ...]] = {}
        lamps: dict[str, Lamp] = {}
        matrices, lamp_matrices, used = [], [], {}
        local = space is not None and space.local_view is not None
        for instance in depsgraph.object_instances:
            if not instance.show_self:
                continue
            obj = instance.object
            if local:
                shown = instance.parent if instance.is_instance else obj
                if not shown.visible_in_viewport_get(space):
                    continue
            kind = obj.type
            if kind in _MESHED:
                changed = all_of_it or obj.name_full in objects or (obj.data is not None and obj.data.name_full in data)
                shape = self._shape(obj, changed, read, used)
                if shape:
                    shapes[_name(instance, obj, shapes)] = shape
                    matrices.append(units.node(np.array(instance.matrix_world)))
            elif kind == "LIGHT":
                matrix = units.node(np.array(instance.matrix_world))
                name = _name(instance, obj, lamps)
                shape = self._shining(obj, matrix, used)
                if shape:
                    shapes[name] = shape
                    # Balls are as large as they say.
                    matrices.append(matrix if obj.data.type == "AREA" else upright(matrix))
                elif obj.data.type != "AREA":
                    lamps[name] = self._lamp(obj.data)
                    lamp_matrices.append(upright(matrix))
            elif kind in _UNKNOWN:
                self._say(f"{obj.name}: {_UNKNOWN[kind]} is not drawn")
        self._meshes, self._shapes = read, used
        placed = np.array(matrices + lamp_matrices, dtype=np.float64).reshape(-1, 4, 4)
        self.content = Content(shapes, lamps, placed, self._environment(depsgraph.scene))
        self.notices = list(self._said)
        return self.content

    def _say(self, text: str) -> None:
        self._said[text] = None

    def _shape(self, obj: Any, changed: bool, read: dict, used: dict) -> tuple[lg.Mesh, ...]:
        data = obj.data
        key = (obj.type, data.as_pointer() if obj.type == "MESH" else obj.name_full)
        slots = tuple(self._material(slot.material) for slot in obj.material_slots)
        textured = any(getattr(m, name) is not None for m in slots for name in TEXTURES)
        bent = any(m.normal_texture is not None or m.coat_normal_texture is not None for m in slots)
        key += (textured, bent)
        if key not in read:
            before = self._meshes.get(key)
            read[key] = before if before is not None and not changed else self._converted(obj, key[-2:], before)
        parts = read[key]
        whole = (*key, *map(id, slots))
        if whole in used:
            return used[whole][0]
        kept = self._shapes.get(whole)
        if kept is not None and kept[1][0] is parts:
            used[whole] = kept
        else:
            made = tuple(_mesh(part, slots) for part in parts)
            # The arrays are kept with what was made of them, so that none takes the place of another.
            used[whole] = (made, (parts, slots))
        return used[whole][0]

    def _converted(self, obj: Any, wanted: tuple[bool, bool], before: list | None) -> list[meshes.Part]:
        if obj.type == "MESH":
            found = meshes.parts(obj.data, *wanted)
        else:
            mesh = obj.to_mesh()
            try:
                found = meshes.parts(mesh, *wanted) if mesh is not None else []
            finally:
                obj.to_mesh_clear()
        if before is not None and len(before) == len(found) and all(a.same(b) for a, b in zip(found, before)):
            return before
        return found

    def _material(self, material: Any) -> lg.Material:
        name = "" if material is None else material.name_full
        if name not in self._materials:
            self._materials[name] = self._made(name, material)
        made, notices = self._materials[name]
        for notice in notices:
            self._say(f"{name}: {notice}")
        return made

    def _reread_materials(self) -> None:
        """Those that are the same again stay the same objects."""
        before, self._materials = self._materials, {}
        for name, (made, _) in before.items():
            material = bpy.data.materials.get(name) if name else None
            if name and material is None:
                continue
            again, notices = self._made(name, material)
            self._materials[name] = (made if _alike(made, again) else again, notices)

    def _made(self, name: str, material: Any) -> tuple[lg.Material, list[str]]:
        said = materials.surface(material)
        made = lg.Material(
            color=tuple(min(1.0, c) for c in said.color),
            emission=said.emission,
            roughness=min(max(said.roughness, 0.0), 1.0),
            metallic=min(max(said.metallic, 0.0), 1.0),
            double_sided=True,
            name=name,
            color_texture=self._image("color", said.notices, said.color_image, said.has_holes),
            emission_texture=self._image("color", said.notices, said.emission_image, False),
            alpha=min(max(said.alpha, 0.0), 1.0),
            finish_texture=self._image("finish", said.notices, said.roughness_image, said.metallic_image),
            normal_texture=self._image("normal", said.notices, said.normal_image),
            normal_scale=said.normal_scale,
            transmission=min(max(said.transmission, 0.0), 1.0),
            ior=min(max(said.ior, 1.0), 4.0),
            coat=min(max(said.coat, 0.0), 1.0),
            coat_roughness=min(max(said.coat_roughness, 0.0), 1.0),
            coat_normal_texture=self._image("normal", said.notices, said.coat_normal_image),
            coat_normal_scale=said.coat_normal_scale,
        )
        return made, said.notices

    def _image(self, kind: str, notices: list[str], *given: Any) -> np.ndarray | None:
        """A texture of a kind, of images or channels of some, kept as long as these stay as they are."""
        sources = [getattr(one, "image", one) for one in given if one is not None and not isinstance(one, bool)]
        if not sources:
            return None
        names = frozenset(image.name_full for image in sources)
        key = (kind, names, tuple(one if isinstance(one, bool) or one is None else _label(one) for one in given))
        if key not in self._images:
            made = getattr(textures, kind)(*given)
            if made is None:
                notices.append(f"can't read {', '.join(sorted(names))}")
                return None
            self._images[key] = made
        return self._images[key]

    def _lamp(self, light: Any) -> Lamp:
        color = _light_color(light)
        if light.type == "SUN":
            if light.angle > SUN_ANGLE:
                self._say(f"{light.name}: its angle is left out; its shadows are sharp")
            return Lamp("SUN", _power(light), color)
        radius = light.shadow_soft_size
        if radius > 0:
            how = "" if light.type == "SPOT" else " (Data > lightgraph makes a ball of it)"
            self._say(f"{light.name}: its radius is left out; it shines from a point{how}")
        candela = units.intensity(_power(light, 4 * np.pi * radius**2))
        if light.type == "SPOT":
            if bpy.app.version < (4, 0):
                self._say(f"{light.name}: it does not fade towards its rim, as Cycles' spots before 4.0 do")
            outer, inner = units.spot_angles(light.spot_size, light.spot_blend)
            return Lamp("SPOT", candela, color, outer, inner)
        return Lamp("POINT", candela, color)

    def _shining(self, obj: Any, matrix: np.ndarray, used: dict) -> tuple[lg.Mesh, ...] | None:
        """Returns the emissive shape of an area light, or of a point with a radius that the camera sees; None for other
        lights."""
        light, seen, version = obj.data, getattr(obj, "visible_camera", True), bpy.app.version
        if light.type == "AREA":
            corners, triangles, area = meshes.face(light.shape, light.size, light.size_y)
            area *= float(np.linalg.norm(np.cross(matrix[:3, 0], matrix[:3, 1])))
            measures = (light.shape, light.size, light.size_y)
            if not seen:
                self._say(f"{obj.name}: its face is seen, too")
            if light.spread < np.pi - 1e-3:
                self._say(f"{light.name}: its spread is left out; it shines to all sides")
        elif light.type == "POINT" and light.shadow_soft_size > 0 and seen:
            corners, triangles, area = meshes.ball(light.shadow_soft_size)
            measures, version = (light.shadow_soft_size,), (4, 0)
        else:
            return None
        if area <= 0:
            return None
        radiance = units.radiance(_power(light, area), area, version)
        emission = tuple(radiance * c for c in _light_color(light))
        key = (light.type, *measures, emission)
        if key not in used:
            kept = self._shapes.get(key)
            material = lg.Material((0.0, 0.0, 0.0), emission, name=light.name)
            used[key] = kept or ((lg.Mesh(corners, triangles, material=material),), ())
        return used[key][0]

    def _environment(self, scene: Any) -> Any:
        said = materials.sky(scene.world)
        for notice in said.notices:
            self._say(f"world: {notice}")
        if said.image is None:
            return said.color if max(said.color) > 0 else None
        key = (said.image.name_full, said.color, said.turn)
        if self._panorama[0] != key or self._panorama[1] is None:
            self._panorama = (key, self._sky_of(said))
        return self._panorama[1]

    def _sky_of(self, said: materials.Sky) -> Any:
        pixels = textures.linear(said.image)
        if pixels is None or pixels.shape[1] != 2 * pixels.shape[0]:
            self._say(f'world: the image "{said.image.name}" is no panorama twice as wide as high; it is left out')
            return None
        # The middle of Blender's panoramas is towards +x, that of lightgraph's towards −z, which is Blender's +y.
        turned = textures.turned(pixels[:, :, :3], 0.25 + said.turn / (2 * np.pi))
        return np.ascontiguousarray(turned * np.array(said.color, np.float32), dtype=np.float32)


def _changes(depsgraph: Any, images: dict) -> tuple[set[str], set[str], bool]:
    """Names of objects and of meshes whose geometry changed, and whether any shading did."""
    objects, data, shading = set(), set(), False
    for update in depsgraph.updates:
        changed = update.id
        if isinstance(changed, bpy.types.Image):
            for key in [k for k in images if changed.name_full in k[1]]:
                del images[key]
        if update.is_updated_geometry:
            (objects if isinstance(changed, bpy.types.Object) else data).add(changed.name_full)
        if not isinstance(changed, (bpy.types.Object, bpy.types.Scene)):
            shading = True
        elif update.is_updated_shading:
            shading = True
    return objects, data, shading


def _name(instance: Any, obj: Any, taken: dict) -> str:
    name = obj.name_full
    if instance.is_instance:
        parent = instance.parent
        ids = ".".join(str(i) for i in instance.persistent_id if i != 0x7FFFFFFF)
        name = f"{parent.name_full if parent else ''}/{name}/{ids}"
    while name in taken:
        name += "'"
    return name


def _mesh(part: meshes.Part, slots: tuple[lg.Material, ...]) -> lg.Mesh:
    material = slots[min(part.slot, len(slots) - 1)] if slots else _PLAIN
    # Light leaves the front alone, in Blender both sides.
    if max(material.emission) > 0 and not meshes.is_closed(part.indices):
        part = meshes.both_sides(part)
        material = replace(material, double_sided=False)
    return lg.Mesh(
        part.positions, part.indices, part.normals, part.uvs, material=material, tangents=part.tangents
    )


def _alike(a: lg.Material, b: lg.Material) -> bool:
    if any(getattr(a, name) is not getattr(b, name) for name in TEXTURES):
        return False
    none = dict.fromkeys(TEXTURES)
    return replace(a, **none) == replace(b, **none)


def _label(one: Any) -> tuple[str, str]:
    """What tells an image, or a channel of one, from another."""
    return getattr(one, "image", one).name_full, getattr(one, "name", "") if hasattr(one, "image") else ""


# Blender's own, where an object has none.
_PLAIN = lg.Material(color=(0.8, 0.8, 0.8), double_sided=True, name="")


def _power(light: Any, area: float = 0.0) -> float:
    """Returns a light's flux in watts, or a sun's irradiance. A light without Normalize states the flux of each m²."""
    power = max(0.0, units.strength(light.energy, getattr(light, "exposure", 0.0)))
    return power if area <= 0 or getattr(light, "normalize", True) else power * area


def _light_color(light: Any) -> tuple[float, float, float]:
    color = np.array(light.color[:3])
    if getattr(light, "use_temperature", False):
        color = color * np.array(light.temperature_color[:3])
    return tuple(float(max(0.0, c)) for c in color)
