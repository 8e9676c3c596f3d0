//! Rays through pixels go where drawing puts what it draws, however far the camera is from the scene's origin.

use crate::{device, support};
use glam::{DVec3, Vec2, Vec3};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::scene::{CameraPose, Lens};
use lightgraph::internals::shader::Library;
use lightgraph::{Checked, Project, Scene, Session, Settings, View};
use std::path::Path;
use std::sync::Arc;

const GRAPH: &str = r#"Graph(
    resources: {
        "origins": Texture(format: Rgba32Float, size: "screen"),
        "directions": Texture(format: Rgba32Float, size: "screen"),
    },
    passes: [Compute(name: "rays", shader: "rays.wgsl", over: "origins")],
    outputs: {"origins": "origins", "directions": "directions"},
)"#;

const RAYS: &str = "#import lightgraph::camera::pixel_ray
var origins: texture_storage_2d<rgba32float, write>;
var directions: texture_storage_2d<rgba32float, write>;
@compute @workgroup_size(8, 8) fn rays(@builtin(global_invocation_id) id: vec3u) {
    let ray = pixel_ray(id.xy);
    textureStore(origins, id.xy, vec4f(ray.origin, 1.0));
    textureStore(directions, id.xy, vec4f(ray.direction, 0.0));
}";

const SIZE: [u32; 2] = [24, 16];

#[test]
fn rays_of_pixels_are_exact_far_from_the_origin() {
    let gpu = device::gpu();
    let source = Source::new("rays.ron", GRAPH);
    let read = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("rays.ron"), &read).unwrap_or_else(|f| panic!("{f}"));
    let mut texts = Library::load(&[support::repository("shaders")]).unwrap_or_else(|f| panic!("{f}"));
    texts.files.insert("rays.wgsl".into(), Source::new("rays.wgsl", RAYS));
    let project = Project { graph, texts };
    let scene = Scene::load(&support::repository("scenes/cornell_point.gltf")).unwrap_or_else(|f| panic!("{f}")).scene;
    let settings = Settings { size: SIZE, ..Settings::default() };
    let mut session = Session::new(&gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"));

    // Away from the scene, before which depth would begin later.
    let forward = Vec3::new(0.6686, 0.523, 0.5286).normalize();
    let up = Vec3::Y.reject_from_normalized(forward).normalize();
    let place = CameraPose { position: Vec3::new(1005.95, 766.3, 953.3), forward, up };
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let (yfov, ymag) = (0.5, 3.0);
    let perspective = Lens::Perspective { yfov, near: 0.05, far: Some(1e5) };
    let parallel = Lens::Orthographic { ymag, near: 0.5, far: 3000.0 };
    for (frame, (lens, shift)) in [
        (perspective, Vec2::ZERO),
        (perspective, Vec2::new(0.25, -0.125)),
        (parallel, Vec2::ZERO),
        (parallel, Vec2::new(0.5, 0.25)),
    ]
    .into_iter()
    .enumerate()
    {
        session.shift.view = Some(View { place, lens, shift });
        session.frame(&gpu, frame as u32, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let image = |name| session.image(&gpu, name).unwrap_or_else(|f| panic!("{f}")).data;
        let (origins, directions) = (image("origins"), image("directions"));
        let (ahead, right, above) = (forward.as_dvec3(), forward.cross(up).as_dvec3(), up.as_dvec3());
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                // Shares of the image's height, from its centre; the shift moves what stands there.
                let across = (f64::from(x) + 0.5) / f64::from(SIZE[0]) - 0.5;
                let down = (f64::from(y) + 0.5) / f64::from(SIZE[1]) - 0.5;
                let at = glam::dvec2(across * f64::from(aspect), -down) + shift.as_dvec2();
                let i = 4 * (y * SIZE[0] + x) as usize;
                let found = |v: &[f32]| DVec3::new(v[i].into(), v[i + 1].into(), v[i + 2].into());
                let eye = place.position.as_dvec3();
                let (origin, direction) = match lens {
                    Lens::Perspective { yfov, .. } => {
                        let half = (f64::from(yfov) / 2.0).tan();
                        let way = ahead + 2.0 * half * (at.x * right + at.y * above);
                        (found(&origins), way.normalize())
                    }
                    Lens::Orthographic { ymag, near, .. } => {
                        let beside = 2.0 * f64::from(ymag) * (at.x * right + at.y * above);
                        (eye + f64::from(near) * ahead + beside, ahead)
                    }
                };
                let turned = (found(&directions) - direction).length();
                assert!(turned < 1e-6, "{lens:?} {x},{y}: {turned}");
                // Coordinates of a thousand are told apart to 6e-5; a ray passes its eye as near.
                let aside = (found(&origins) - origin).length();
                let passed = (found(&origins) - eye).cross(direction).length();
                assert!(aside < 3e-4, "{lens:?} {x},{y}: {aside}");
                assert!(matches!(lens, Lens::Orthographic { .. }) || passed < 3e-4, "{lens:?} {x},{y}: {passed}");
            }
        }
    }
}
