//! The tables shaders read, in world space at a pose.

use super::{
    Column, TABLES, Table,
    bvh::Bvh,
    clusters::{self, Cluster},
    light_views::{LightView, light_views},
    model::Scene,
    motion::Pose,
};
use glam::{Mat3, Mat4, Vec2, Vec3};

/// A triangle in world space.
struct Triangle {
    corners: [Vec3; 3],
    normals: [Vec3; 3],
    uvs: [Vec2; 3],
    material: u32,
}

impl Triangle {
    fn area(&self) -> f32 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a).length()
    }
}

/// What stands in `base_color_texture` for none.
const NO_TEXTURE: u32 = u32::MAX;

impl Scene {
    /// The tables of [`TABLES`], in their order, at a pose of this scene.
    pub fn tables(&self, pose: &Pose) -> Vec<Table> {
        self.tables_named(pose, |_| true)
    }

    /// The tables whose names pass, in the order of [`TABLES`]; the others cost nothing.
    pub fn tables_named(&self, pose: &Pose, wanted: impl Fn(&str) -> bool) -> Vec<Table> {
        let traced = ["triangles", "bvh"].into_iter().any(&wanted);
        let placed = traced || ["light_views", "clusters", "emitters"].into_iter().any(&wanted);
        let triangles = if placed { self.world_triangles(pose) } else { vec![] };
        let corners: Vec<[Vec3; 3]> = triangles.iter().map(|t| t.corners).collect();
        let bvh = if traced { Bvh::new(&corners) } else { Bvh::new(&[]) };
        let table = |name: &str| match name {
            "nodes" => Some(nodes(pose)),
            "materials" => Some(self.material_table()),
            "lights" => Some(self.light_table(pose)),
            "light_views" => Some(light_view_table(&light_views(self, pose, &corners))),
            "triangles" => Some(triangle_table(&triangles, &bvh)),
            "bvh" => Some(bvh_table(&bvh)),
            "clusters" => Some(cluster_table(&self.geometry.clusters, &corners)),
            "emitters" => Some(self.emitter_table(&triangles)),
            _ => None,
        };
        TABLES.iter().filter(|(name, _)| wanted(name)).filter_map(|(name, _)| table(name)).collect()
    }

    fn world_triangles(&self, pose: &Pose) -> Vec<Triangle> {
        let normals: Vec<Mat3> = pose.nodes.iter().map(normal_matrix).collect();
        let vertices = &self.geometry.vertices;
        self.corners()
            .map(|c| {
                let corners = c.map(|i| &vertices[i as usize]);
                Triangle {
                    corners: corners.map(|v| pose.nodes[v.node as usize].transform_point3(v.position.into())),
                    normals: corners
                        .map(|v| (normals[v.node as usize] * Vec3::from(v.normal)).try_normalize().unwrap_or(Vec3::Y)),
                    uvs: corners.map(|v| v.uv.into()),
                    material: corners[0].material,
                }
            })
            .collect()
    }

    fn material_table(&self) -> Table {
        let all = &self.materials;
        Table {
            name: "materials",
            rows: all.len(),
            columns: vec![
                ("base_color", Column::Vec4(all.iter().map(|m| m.base_color).collect())),
                (
                    "base_color_texture",
                    Column::Uint(all.iter().map(|m| m.base_color_texture.unwrap_or(NO_TEXTURE)).collect()),
                ),
                ("emission", Column::Vec3(all.iter().map(|m| m.emission).collect())),
                ("double_sided", Column::Uint(all.iter().map(|m| m.double_sided.into()).collect())),
                ("specular", Column::Float(all.iter().map(|m| m.specular).collect())),
                ("shininess", Column::Float(all.iter().map(|m| m.shininess).collect())),
                ("roughness", Column::Float(all.iter().map(|m| m.roughness).collect())),
                ("metallic", Column::Float(all.iter().map(|m| m.metallic).collect())),
            ],
        }
    }

    fn light_table(&self, pose: &Pose) -> Table {
        let all = &self.lights;
        let mut next = 0;
        let mut first_view = vec![];
        for light in all {
            first_view.push(next);
            next += light.kind.views();
        }
        Table {
            name: "lights",
            rows: all.len(),
            columns: vec![
                ("kind", Column::Uint(all.iter().map(|l| l.kind as u32).collect())),
                ("position", Column::Vec3(pose.lights.iter().map(|l| l.position).collect())),
                ("direction", Column::Vec3(pose.lights.iter().map(|l| l.direction).collect())),
                ("intensity", Column::Vec3(all.iter().map(|l| l.intensity).collect())),
                ("range", Column::Float(all.iter().map(|l| l.range).collect())),
                ("cos_inner", Column::Float(all.iter().map(|l| l.inner.cos()).collect())),
                ("cos_outer", Column::Float(all.iter().map(|l| l.outer.cos()).collect())),
                ("first_view", Column::Uint(first_view)),
                ("views", Column::Uint(all.iter().map(|l| l.kind.views()).collect())),
            ],
        }
    }

    fn emitter_table(&self, triangles: &[Triangle]) -> Table {
        let radiance = |t: &Triangle| self.materials.get(t.material as usize).map(|m| m.emission);
        let all: Vec<(&Triangle, Vec3)> =
            triangles.iter().filter_map(|t| radiance(t).filter(|e| e.max_element() > 0.0).map(|e| (t, e))).collect();
        let power = |(t, e): &(&Triangle, Vec3)| f64::from(e.element_sum()) * f64::from(t.area());
        let total: f64 = all.iter().map(power).sum();
        let mut sum = 0.0;
        let mut cumulative = vec![];
        for emitter in &all {
            sum += power(emitter);
            cumulative.push((sum / total) as f32);
        }
        if let Some(last) = cumulative.last_mut() {
            *last = 1.0;
        }
        let corner = |i: usize| Column::Vec3(all.iter().map(|(t, _)| t.corners[i]).collect());
        Table {
            name: "emitters",
            rows: all.len(),
            columns: vec![
                ("a", corner(0)),
                ("b", corner(1)),
                ("c", corner(2)),
                ("radiance", Column::Vec3(all.iter().map(|(_, e)| *e).collect())),
                ("area", Column::Float(all.iter().map(|(t, _)| t.area()).collect())),
                ("cumulative", Column::Float(cumulative)),
                (
                    "density",
                    Column::Float(all.iter().map(|(_, e)| (f64::from(e.element_sum()) / total) as f32).collect()),
                ),
            ],
        }
    }
}

fn nodes(pose: &Pose) -> Table {
    let normals = pose.nodes.iter().map(|m| Mat4::from_mat3(normal_matrix(m))).collect();
    Table {
        name: "nodes",
        rows: pose.nodes.len(),
        columns: vec![("transform", Column::Mat4(pose.nodes.clone())), ("inverse_transpose", Column::Mat4(normals))],
    }
}

fn light_view_table(views: &[LightView]) -> Table {
    Table {
        name: "light_views",
        rows: views.len(),
        columns: vec![
            ("light", Column::Uint(views.iter().map(|v| v.light).collect())),
            ("view_projection", Column::Mat4(views.iter().map(|v| v.view_projection).collect())),
            ("near", Column::Float(views.iter().map(|v| v.near).collect())),
            ("far", Column::Float(views.iter().map(|v| v.far).collect())),
        ],
    }
}

fn cluster_table(clusters: &[Cluster], corners: &[[Vec3; 3]]) -> Table {
    let bounds: Vec<_> = clusters.iter().map(|c| clusters::bounds(c, corners)).collect();
    Table {
        name: "clusters",
        rows: clusters.len(),
        columns: vec![
            ("lower", Column::Vec3(bounds.iter().map(|b| b.min).collect())),
            ("upper", Column::Vec3(bounds.iter().map(|b| b.max).collect())),
            ("first", Column::Uint(clusters.iter().map(|c| c.first).collect())),
            ("count", Column::Uint(clusters.iter().map(|c| c.count).collect())),
            ("node", Column::Uint(clusters.iter().map(|c| c.node).collect())),
        ],
    }
}

fn triangle_table(triangles: &[Triangle], bvh: &Bvh) -> Table {
    let ordered = || bvh.order.iter().map(|i| &triangles[*i as usize]);
    let corner = |i: usize| Column::Vec3(ordered().map(|t| t.corners[i]).collect());
    let normal = |i: usize| Column::Vec3(ordered().map(|t| t.normals[i]).collect());
    let uv = |i: usize| Column::Vec2(ordered().map(|t| t.uvs[i]).collect());
    Table {
        name: "triangles",
        rows: bvh.order.len(),
        columns: vec![
            ("a", corner(0)),
            ("b", corner(1)),
            ("c", corner(2)),
            ("na", normal(0)),
            ("nb", normal(1)),
            ("nc", normal(2)),
            ("uva", uv(0)),
            ("uvb", uv(1)),
            ("uvc", uv(2)),
            ("material", Column::Uint(ordered().map(|t| t.material).collect())),
        ],
    }
}

fn bvh_table(bvh: &Bvh) -> Table {
    let all = &bvh.nodes;
    Table {
        name: "bvh",
        rows: all.len(),
        columns: vec![
            ("lower", Column::Vec3(all.iter().map(|n| n.bounds.min).collect())),
            ("upper", Column::Vec3(all.iter().map(|n| n.bounds.max).collect())),
            ("first", Column::Uint(all.iter().map(|n| n.first).collect())),
            ("count", Column::Uint(all.iter().map(|n| n.count).collect())),
        ],
    }
}

/// The matrix that turns normals: the inverse transpose, or where a flattening transform has none, the matrix of
/// cofactors, which points the same way. Normals are to be normalised after it.
fn normal_matrix(transform: &Mat4) -> Mat3 {
    let m = Mat3::from_mat4(*transform);
    let inverse = m.inverse().transpose();
    if inverse.is_finite() {
        return inverse;
    }
    let cofactors = Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if cofactors.is_finite() { cofactors } else { Mat3::IDENTITY }
}
