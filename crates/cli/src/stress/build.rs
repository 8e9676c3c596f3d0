//! Small glTF files in memory: what the cases' scenes are made of. They go through the loader that every file goes
//! through.

use crate::glb::glb;
use glam::{DQuat, DVec3};
use serde_json::{Value, json};

/// Triangles in a space of their own.
#[derive(Debug, Clone, Default)]
pub(super) struct MeshBuilder {
    pub positions: Vec<[f32; 3]>,
    /// As many as positions, or none: flat shading.
    pub normals: Vec<[f32; 3]>,
    pub indices: Vec<u32>,
}

impl MeshBuilder {
    /// Corners counter-clockwise as seen from the front.
    pub fn quad(&mut self, corners: [DVec3; 4]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(|c| c.as_vec3().to_array()));
        self.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }

    /// The six sides of a box, each facing outward, in the order −x +x −y +y −z +z.
    pub fn sides(low: DVec3, high: DVec3) -> [MeshBuilder; 6] {
        let p = |x: usize, y: usize, z: usize| {
            let pick = |i: usize, a: f64, b: f64| if i == 0 { a } else { b };
            DVec3::new(pick(x, low.x, high.x), pick(y, low.y, high.y), pick(z, low.z, high.z))
        };
        [
            [p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)],
            [p(1, 0, 1), p(1, 0, 0), p(1, 1, 0), p(1, 1, 1)],
            [p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)],
            [p(0, 1, 1), p(1, 1, 1), p(1, 1, 0), p(0, 1, 0)],
            [p(1, 0, 0), p(0, 0, 0), p(0, 1, 0), p(1, 1, 0)],
            [p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)],
        ]
        .map(|corners| {
            let mut mesh = MeshBuilder::default();
            mesh.quad(corners);
            mesh
        })
    }

    /// Seen from the other side.
    pub fn inside_out(mut self) -> MeshBuilder {
        self.indices.chunks_exact_mut(3).for_each(|t| t.swap(1, 2));
        self.normals.iter_mut().flatten().for_each(|x| *x = -*x);
        self
    }

    pub fn add(&mut self, other: &MeshBuilder) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.indices.extend(other.indices.iter().map(|i| first + i));
    }

    /// A sphere round the origin, facing outward, with smooth normals: an icosahedron whose triangles were cut in
    /// four `cuts` times.
    pub fn sphere(radius: f64, cuts: u32) -> MeshBuilder {
        let t = f64::midpoint(1.0, 5.0_f64.sqrt());
        let mut corners: Vec<DVec3> = [
            (-1.0, t, 0.0),
            (1.0, t, 0.0),
            (-1.0, -t, 0.0),
            (1.0, -t, 0.0),
            (0.0, -1.0, t),
            (0.0, 1.0, t),
            (0.0, -1.0, -t),
            (0.0, 1.0, -t),
            (t, 0.0, -1.0),
            (t, 0.0, 1.0),
            (-t, 0.0, -1.0),
            (-t, 0.0, 1.0),
        ]
        .map(|(x, y, z)| DVec3::new(x, y, z).normalize())
        .to_vec();
        let mut faces: Vec<[u32; 3]> = vec![
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ];
        for _ in 0..cuts {
            let mut known = std::collections::BTreeMap::new();
            let mut finer = vec![];
            for [a, b, c] in faces {
                let mut middle = |a: u32, b: u32| {
                    *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        corners.push((corners[a as usize] + corners[b as usize]).normalize());
                        corners.len() as u32 - 1
                    })
                };
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            faces = finer;
        }
        MeshBuilder {
            positions: corners.iter().map(|c| (*c * radius).as_vec3().to_array()).collect(),
            normals: corners.iter().map(|c| c.as_vec3().to_array()).collect(),
            indices: faces.into_iter().flatten().collect(),
        }
    }

    /// `n` × `n` squares of two triangles on the plane y = 0, `edge` metres in all, facing up.
    pub fn field(n: u32, edge: f64) -> MeshBuilder {
        let mut mesh = MeshBuilder::default();
        for z in 0..=n {
            for x in 0..=n {
                let at = |i: u32| ((f64::from(i) / f64::from(n) - 0.5) * edge) as f32;
                mesh.positions.push([at(x), 0.0, at(z)]);
            }
        }
        mesh.normals = vec![[0.0, 1.0, 0.0]; mesh.positions.len()];
        for z in 0..n {
            for x in 0..n {
                let a = z * (n + 1) + x;
                let c = a + n + 1;
                mesh.indices.extend([a, c, a + 1, a + 1, c, c + 1]);
            }
        }
        mesh
    }
}

/// How a whole scene is placed: x ↦ translation + turn · (scale · x).
#[derive(Debug, Clone, Copy)]
pub(super) struct ScenePlacement {
    pub translation: DVec3,
    pub turn: DQuat,
    pub scale: f64,
}

/// A glTF file under construction. Every node hangs from one root.
#[derive(Debug, Default)]
pub(super) struct GltfBuilder {
    nodes: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    bytes: Vec<u8>,
    /// By material that has them: name, Phong strength and exponent, for the scene RON.
    gloss: Vec<(String, f64, f64)>,
}

impl GltfBuilder {
    /// A material with a name of its own.
    pub fn material(&mut self, albedo: f64, emission: f64, gloss: Option<(f64, f64)>) -> usize {
        let name = format!("material {}", self.materials.len());
        if let Some((strength, exponent)) = gloss {
            self.gloss.push((name.clone(), strength, exponent));
        }
        // Up to 1 the factor says it; above, the strength does.
        let strength = emission.max(1.0);
        let factor = emission / strength;
        let mut value = json!({
            "name": name,
            "pbrMetallicRoughness": {"baseColorFactor": [albedo, albedo, albedo, 1.0], "metallicFactor": 0.0},
            "emissiveFactor": [factor, factor, factor],
        });
        if strength > 1.0 {
            value["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
        }
        self.materials.push(value);
        self.materials.len() - 1
    }

    /// A mesh at a node of its own; `node` may hold a transform.
    pub fn mesh(&mut self, mesh: &MeshBuilder, material: usize, mut node: Value) {
        let floats = |rows: &[[f32; 3]]| rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        let position = self.accessor(&floats(&mesh.positions), 5126, mesh.positions.len(), "VEC3");
        let mut attributes = json!({"POSITION": position});
        if !mesh.normals.is_empty() {
            attributes["NORMAL"] = json!(self.accessor(&floats(&mesh.normals), 5126, mesh.normals.len(), "VEC3"));
        }
        let words: Vec<u8> = mesh.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = self.accessor(&words, 5125, mesh.indices.len(), "SCALAR");
        self.meshes.push(json!({"primitives": [{"attributes": attributes, "indices": indices, "material": material}]}));
        node["mesh"] = json!(self.meshes.len() - 1);
        self.nodes.push(node);
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        self.views.push(json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()}));
        self.bytes.extend(bytes);
        let view = self.views.len() - 1;
        self.accessors.push(json!({"bufferView": view, "componentType": component, "count": count, "type": shape}));
        self.accessors.len() - 1
    }

    /// A light as `KHR_lights_punctual` states it, at a point, looking towards another.
    pub fn light(&mut self, light: Value, at: DVec3, to: DVec3) {
        self.lights.push(light);
        let extension = json!({"KHR_lights_punctual": {"light": self.lights.len() - 1}});
        self.nodes.push(json!({
            "translation": at.to_array(), "rotation": facing(to - at).to_array(), "extensions": extension,
        }));
    }

    /// A camera of 60° called `name`; its depths are in units of the scene.
    pub fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, unit: f64) {
        let lens = json!({"yfov": 60.0_f64.to_radians(), "znear": 0.05 * unit, "zfar": 100.0 * unit});
        self.cameras.push(json!({"type": "perspective", "perspective": lens}));
        let camera = self.cameras.len() - 1;
        let rotation = facing(target - eye).to_array();
        self.nodes.push(json!({"name": name, "translation": eye.to_array(), "rotation": rotation, "camera": camera}));
    }

    /// A GLB, and the text of the scene RON where it needs one.
    pub fn finish(self, root: Option<ScenePlacement>) -> (Vec<u8>, Option<String>) {
        let mut nodes = self.nodes;
        let children: Vec<usize> = (0..nodes.len()).collect();
        let mut top = json!({"name": "all", "children": children});
        if let Some(p) = root {
            top["translation"] = json!(p.translation.to_array());
            top["rotation"] = json!(p.turn.to_array());
            top["scale"] = json!([p.scale, p.scale, p.scale]);
        }
        nodes.push(top);
        let mut json = json!({
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [nodes.len() - 1]}],
            "buffers": [{"byteLength": self.bytes.len()}],
            "extensions": {"KHR_lights_punctual": {"lights": self.lights}},
        });
        for (name, list) in [
            ("nodes", nodes),
            ("meshes", self.meshes),
            ("materials", self.materials),
            ("accessors", self.accessors),
            ("bufferViews", self.views),
            ("cameras", self.cameras),
        ] {
            json[name] = Value::Array(list);
        }
        let gloss: Vec<String> = self
            .gloss
            .iter()
            .map(|(name, strength, exponent)| format!("\"{name}\": (specular: {strength:?}, shininess: {exponent:?})"))
            .collect();
        let description = (!gloss.is_empty()).then(|| format!("Scene(materials: {{{}}})", gloss.join(", ")));
        (glb(&json.to_string(), &self.bytes), description)
    }
}

/// The rotation that turns −z, where glTF's cameras and lights look, to a direction.
fn facing(direction: DVec3) -> DQuat {
    let forward = direction.try_normalize().unwrap_or(DVec3::NEG_Z);
    let up = if forward.y.abs() > 0.99 { DVec3::Z } else { DVec3::Y };
    let right = forward.cross(up).normalize();
    DQuat::from_mat3(&glam::DMat3::from_cols(right, right.cross(forward), -forward))
}
