//! Writes binary glTF 2.0: a JSON chunk and one buffer.

use crate::mesh::TriangleMesh;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::{Value, json};

/// Place of a material in the file.
#[derive(Debug, Clone, Copy)]
pub struct MaterialIndex(usize);

/// Place of a mesh in the file.
#[derive(Debug, Clone, Copy)]
pub struct MeshId(usize);

/// Place of a light in the file.
#[derive(Debug, Clone, Copy)]
pub struct LightIndex(usize);

/// A glTF file under construction.
#[derive(Debug, Default)]
pub struct GlbBuilder {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    /// Triangles and which materials have a texture, by place in the file.
    mesh_triangles: Vec<usize>,
    textured: Vec<bool>,
    materials: Vec<Value>,
    images: Vec<Value>,
    /// Images whose texels are read one by one.
    nearest: Vec<usize>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    skins: Vec<Value>,
    animations: Vec<Value>,
    buffer: Vec<u8>,
    triangles: usize,
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const FLOAT: u32 = 5126;
const NEAREST: u32 = 9728;

impl GlbBuilder {
    pub fn new() -> GlbBuilder {
        GlbBuilder::default()
    }

    /// A Lambert surface of the given linear albedo.
    pub fn matte(&mut self, name: &str, albedo: [f64; 3]) -> MaterialIndex {
        self.material(name, albedo, json!({}), None)
    }

    /// A thin Lambert sheet, seen from both sides.
    pub fn cloth(&mut self, name: &str, albedo: [f64; 3]) -> MaterialIndex {
        self.material(name, albedo, json!({ "doubleSided": true }), None)
    }

    /// A Lambert surface that also gives off `radiance`, at most 1, from its front.
    pub fn emissive(&mut self, name: &str, albedo: [f64; 3], radiance: [f64; 3]) -> MaterialIndex {
        self.material(name, albedo, json!({ "emissiveFactor": radiance }), None)
    }

    /// A black surface that gives off `radiance`, of any strength, from its front.
    pub fn glowing(&mut self, name: &str, radiance: [f64; 3]) -> MaterialIndex {
        // glTF's factors are at most 1.
        let most = radiance.into_iter().fold(0.0, f64::max);
        let strength = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": round(most) } });
        let factor = radiance.map(|r| round(r / most));
        self.material(name, [0.0; 3], json!({ "emissiveFactor": factor, "extensions": strength }), None)
    }

    /// A Lambert surface whose albedo is a PNG image (sRGB).
    pub fn textured(&mut self, name: &str, png: &[u8]) -> MaterialIndex {
        let image = self.image(name, png, false);
        self.material(name, [1.0; 3], json!({}), Some(image))
    }

    /// A PNG image for materials of `described`; its place in the file. Of `nearest` no mean of texels is read.
    pub fn image(&mut self, name: &str, png: &[u8], nearest: bool) -> usize {
        let view = self.view(png, None);
        self.images.push(json!({ "name": name, "bufferView": view, "mimeType": "image/png" }));
        let image = self.images.len() - 1;
        if nearest {
            self.nearest.push(image);
        }
        image
    }

    /// A material in glTF's own words.
    pub fn described(&mut self, name: &str, mut value: Value) -> MaterialIndex {
        value["name"] = json!(name);
        self.textured.push(value.to_string().contains("Texture"));
        self.materials.push(value);
        MaterialIndex(self.materials.len() - 1)
    }

    /// A metal of glTF's model; the colour is what it reflects head on.
    pub fn metal(&mut self, name: &str, color: [f64; 3], roughness: f64) -> MaterialIndex {
        let made = self.material(name, color, json!({}), None);
        let finish = &mut self.materials[made.0]["pbrMetallicRoughness"];
        finish["metallicFactor"] = json!(1.0);
        finish["roughnessFactor"] = json!(roughness);
        made
    }

    fn material(&mut self, name: &str, albedo: [f64; 3], mut value: Value, texture: Option<usize>) -> MaterialIndex {
        let [r, g, b] = albedo;
        value["name"] = json!(name);
        value["pbrMetallicRoughness"] =
            json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        if let Some(index) = texture {
            value["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": index });
        }
        self.textured.push(texture.is_some());
        self.materials.push(value);
        MaterialIndex(self.materials.len() - 1)
    }

    /// A mesh of one primitive a material.
    pub fn mesh(&mut self, name: &str, parts: &[(&TriangleMesh, MaterialIndex)]) -> MeshId {
        let primitives = parts.iter().map(|(mesh, material)| self.primitive(mesh, *material)).collect();
        self.mesh_of(name, parts, primitives)
    }

    fn mesh_of(&mut self, name: &str, parts: &[(&TriangleMesh, MaterialIndex)], primitives: Vec<Value>) -> MeshId {
        self.meshes.push(json!({ "name": name, "primitives": primitives }));
        self.mesh_triangles.push(parts.iter().map(|(mesh, _)| mesh.triangle_count()).sum());
        MeshId(self.meshes.len() - 1)
    }

    /// A mesh of one material, of whose vertices `more` says more: of their positions, into the primitive.
    pub fn mesh_with(
        &mut self,
        name: &str,
        mesh: &TriangleMesh,
        material: MaterialIndex,
        more: impl FnOnce(&mut GlbBuilder, &[[f32; 3]], &mut Value),
    ) -> MeshId {
        let mut primitive = self.primitive(mesh, material);
        let welded = mesh.weld(self.textured[material.0]);
        more(self, &welded.positions, &mut primitive);
        self.mesh_of(name, &[(mesh, material)], vec![primitive])
    }

    /// A mesh in glTF's own words, to add what this writer has no words for.
    pub fn words_of(&mut self, mesh: MeshId) -> &mut Value {
        &mut self.meshes[mesh.0]
    }

    /// An accessor of vectors or, of 16 numbers, of matrices.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let shape = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].get(N).unwrap_or(&"MAT4");
        self.accessor(bytemuck::cast_slice(values.as_flattened()), values.len(), FLOAT, shape)
    }

    /// An accessor of places, or of what moves them.
    pub fn places(&mut self, values: &[[f32; 3]]) -> usize {
        let index = self.floats(values);
        for (name, pick) in [("min", f32::min as fn(f32, f32) -> f32), ("max", f32::max)] {
            let extent: [f32; 3] =
                std::array::from_fn(|axis| values.iter().map(|v| v[axis]).reduce(pick).unwrap_or(0.0));
            self.accessors[index][name] = json!(extent);
        }
        index
    }

    /// An accessor of times.
    pub fn times(&mut self, times: &[f32]) -> usize {
        let index = self.accessor(bytemuck::cast_slice(times), times.len(), FLOAT, "SCALAR");
        self.accessors[index]["min"] = json!([times[0]]);
        self.accessors[index]["max"] = json!([times[times.len() - 1]]);
        index
    }

    /// An accessor of four small numbers a row.
    pub fn bytes(&mut self, values: &[[u8; 4]]) -> usize {
        self.accessor(values.as_flattened(), values.len(), UNSIGNED_BYTE, "VEC4")
    }

    /// A node in glTF's own words; its place in the file.
    pub fn node(&mut self, mut value: Value, mesh: Option<MeshId>) -> usize {
        if let Some(mesh) = mesh {
            value["mesh"] = json!(mesh.0);
            self.triangles += self.mesh_triangles[mesh.0];
        }
        self.nodes.push(value);
        self.nodes.len() - 1
    }

    /// A skin in glTF's own words; its place in the file.
    pub fn skin(&mut self, value: Value) -> usize {
        self.skins.push(value);
        self.skins.len() - 1
    }

    /// An animation in glTF's own words.
    pub fn animation(&mut self, value: Value) {
        self.animations.push(value);
    }

    fn primitive(&mut self, mesh: &TriangleMesh, material: MaterialIndex) -> Value {
        let textured = self.textured[material.0];
        let welded = mesh.weld(textured);
        let count = welded.positions.len();
        assert!(count <= 65_535, "a primitive has {count} vertices; 16-bit indices reach 65,535");
        let mut attributes = json!({});
        attributes["POSITION"] = json!(self.places(&welded.positions));
        if !welded.flat {
            attributes["NORMAL"] = json!(self.accessor(bytemuck::cast_slice(&welded.normals), count, FLOAT, "VEC3"));
        }
        if textured {
            attributes["TEXCOORD_0"] = json!(self.accessor(bytemuck::cast_slice(&welded.uvs), count, FLOAT, "VEC2"));
        }
        let indices: Vec<u16> = welded.indices.iter().map(|&i| i as u16).collect();
        let indices = self.accessor(bytemuck::cast_slice(&indices), indices.len(), UNSIGNED_SHORT, "SCALAR");
        json!({ "attributes": attributes, "indices": indices, "material": material.0 })
    }

    fn accessor(&mut self, bytes: &[u8], count: usize, component: u32, shape: &str) -> usize {
        let target = if component == FLOAT { ARRAY_BUFFER } else { ELEMENT_ARRAY_BUFFER };
        let view = self.view(bytes, Some(target));
        self.accessors.push(json!({ "bufferView": view, "componentType": component, "count": count, "type": shape }));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.buffer.extend_from_slice(bytes);
        pad(&mut self.buffer, 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// A node that shows a mesh.
    pub fn place(&mut self, name: &str, mesh: MeshId, transform: DAffine3) {
        let (scale, rotation, translation) = transform.to_scale_rotation_translation();
        let mut node = posed(name, translation, rotation);
        if (scale - DVec3::ONE).abs().max_element() > 1e-9 {
            node["scale"] = rounded(&scale.to_array());
        }
        node["mesh"] = json!(mesh.0);
        self.nodes.push(node);
        self.triangles += self.mesh_triangles[mesh.0];
    }

    /// A mesh of one material at the origin, with its node.
    pub fn fixture(&mut self, name: &str, mesh: &TriangleMesh, material: MaterialIndex) {
        let id = self.mesh(name, &[(mesh, material)]);
        self.place(name, id, DAffine3::IDENTITY);
    }

    /// A camera at `eye` that looks at `target`; `yfov` is the vertical angle in degrees.
    pub fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, yfov: f64) {
        let perspective = json!({ "yfov": round(yfov.to_radians()), "znear": 0.05, "zfar": 100.0 });
        self.cameras.push(json!({ "name": name, "type": "perspective", "perspective": perspective }));
        let mut node = posed(name, eye, facing(target - eye));
        node["camera"] = json!(self.cameras.len() - 1);
        self.nodes.push(node);
    }

    /// `candela` is radiant intensity a channel.
    pub fn point_light(&mut self, name: &str, position: DVec3, candela: f64) {
        self.light(json!({ "name": name, "type": "point", "intensity": candela }), position, DQuat::IDENTITY);
    }

    /// A spot light; the cone's angles are measured from its axis, in degrees.
    pub fn spot_light(&mut self, name: &str, position: DVec3, target: DVec3, candela: f64, cone: [f64; 2]) {
        let [inner, outer] = cone.map(|angle| round(angle.to_radians()));
        let spot = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
        let light = json!({ "name": name, "type": "spot", "intensity": candela, "spot": spot });
        self.light(light, position, facing(target - position));
    }

    /// The sun: parallel light that travels from above `from` the origin; `irradiance` on what faces it, a channel.
    pub fn sun(&mut self, name: &str, from: DVec3, irradiance: [f64; 3]) {
        let most = irradiance.into_iter().fold(0.0, f64::max);
        let color = irradiance.map(|c| round(c / most));
        let light = json!({ "name": name, "type": "directional", "color": color, "intensity": round(most) });
        self.light(light, from, facing(-from));
    }

    /// A point light for many places; `candela` times `color` is radiant intensity.
    pub fn lamp(&mut self, name: &str, color: [f64; 3], candela: f64) -> LightIndex {
        // glTF's colours are at most 1.
        let most = color.into_iter().fold(0.0, f64::max);
        let color = color.map(|c| round(c / most));
        let light = json!({ "name": name, "type": "point", "color": color, "intensity": round(candela * most) });
        self.lights.push(light);
        LightIndex(self.lights.len() - 1)
    }

    /// A node that shows a light.
    pub fn hang(&mut self, light: LightIndex, position: DVec3) {
        self.place_light(light, position, DQuat::IDENTITY);
    }

    fn light(&mut self, light: Value, position: DVec3, rotation: DQuat) {
        self.lights.push(light);
        self.place_light(LightIndex(self.lights.len() - 1), position, rotation);
    }

    fn place_light(&mut self, light: LightIndex, position: DVec3, rotation: DQuat) {
        let name = self.lights[light.0]["name"].as_str().unwrap_or("light");
        let mut node = posed(name, position, rotation);
        node["extensions"] = json!({ "KHR_lights_punctual": { "light": light.0 } });
        self.nodes.push(node);
    }

    /// Triangles over all placed meshes.
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// The file's bytes.
    pub fn finish(self) -> Vec<u8> {
        let below: Vec<&Value> = self.nodes.iter().filter_map(|n| n["children"].as_array()).flatten().collect();
        let roots: Vec<usize> = (0..self.nodes.len()).filter(|i| !below.contains(&&json!(i))).collect();
        let mut root = json!({
            "asset": { "version": "2.0", "generator": "lightgraph make_scenes", "copyright": "CC0 1.0" },
            "scene": 0,
            "scenes": [{ "nodes": roots }],
            "buffers": [{ "byteLength": self.buffer.len() }],
        });
        if !self.images.is_empty() {
            root["samplers"] = json!([{}]);
            if !self.nearest.is_empty() {
                root["samplers"] = json!([{}, { "magFilter": NEAREST, "minFilter": NEAREST }]);
            }
            let sampler = |image| usize::from(self.nearest.contains(&image));
            let textures = (0..self.images.len()).map(|image| json!({ "source": image, "sampler": sampler(image) }));
            root["textures"] = textures.collect();
        }
        let mut used = vec![];
        if self.materials.iter().any(|m| m["extensions"].is_object()) {
            used.push("KHR_materials_emissive_strength");
        }
        if !self.lights.is_empty() {
            used.push("KHR_lights_punctual");
            root["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        if !used.is_empty() {
            root["extensionsUsed"] = json!(used);
        }
        // glTF forbids empty lists.
        for (name, list) in [
            ("nodes", self.nodes),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("images", self.images),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
            ("cameras", self.cameras),
            ("skins", self.skins),
            ("animations", self.animations),
        ] {
            if !list.is_empty() {
                root[name] = Value::Array(list);
            }
        }

        let mut text = root.to_string().into_bytes();
        pad(&mut text, b' ');
        let mut buffer = self.buffer;
        pad(&mut buffer, 0);
        let mut out = Vec::with_capacity(28 + text.len() + buffer.len());
        let total = 12 + 8 + text.len() + 8 + buffer.len();
        for word in [0x4654_6C67, 2, total as u32, text.len() as u32, 0x4E4F_534A] {
            out.extend_from_slice(&u32::to_le_bytes(word));
        }
        out.extend_from_slice(&text);
        for word in [buffer.len() as u32, 0x004E_4942] {
            out.extend_from_slice(&u32::to_le_bytes(word));
        }
        out.extend_from_slice(&buffer);
        out
    }
}

/// The rotation that turns −Z, where glTF's cameras and lights look, to `direction`, upright.
fn facing(direction: DVec3) -> DQuat {
    let back = -direction.normalize();
    let up = if back.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
    let right = up.cross(back).normalize();
    DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
}

fn posed(name: &str, translation: DVec3, rotation: DQuat) -> Value {
    let mut node = json!({ "name": name });
    if translation != DVec3::ZERO {
        node["translation"] = rounded(&translation.to_array());
    }
    if rotation.angle_between(DQuat::IDENTITY) > 1e-9 {
        node["rotation"] = rounded(&rotation.to_array());
    }
    node
}

/// Eight decimals: more than f32 holds, fewer than those on which systems differ.
fn round(x: f64) -> f64 {
    (x * 1e8).round() / 1e8 + 0.0
}

fn rounded(values: &[f64]) -> Value {
    values.iter().map(|&x| round(x)).collect()
}

/// GLB chunks and glTF views start on multiples of four bytes.
fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}
