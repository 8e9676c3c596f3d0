//! Light from all around, suns and cameras that files don't hold: closed forms, and what is made up and said.

use crate::device::{Shot, gpu};
use crate::support::{Scratch, repository};
use glam::Vec3;
use lightgraph::internals::diag::render;
use lightgraph::internals::scene::{self, AddedCamera, AddedEnvironment, AddedLight, Additions, LightKind};
use lightgraph::internals::value::Value;
use lightgraph::{Image, Project, Scene, Session, Settings};
use std::f32::consts::PI;
use std::sync::Arc;

const ALBEDO: [f64; 3] = [0.8, 0.5, 0.2];

/// The mean over the pixels of the middle half of an image, along both axes.
fn middle(image: &Image) -> [f64; 3] {
    let (w, h) = (image.width, image.height);
    let inside = |i: u32| (w / 4..w * 3 / 4).contains(&(i % w)) && (h / 4..h * 3 / 4).contains(&(i / w));
    let mut sum = [0.0; 3];
    let mut count = 0.0;
    for (_, pixel) in image.rgb().enumerate().filter(|(i, _)| inside(*i as u32)) {
        count += 1.0;
        sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += f64::from(value));
    }
    sum.map(|s| s / count)
}

fn close(found: [f64; 3], expected: [f64; 3], share: f64, what: &str) {
    for (found, expected) in found.iter().zip(expected) {
        let error = found / expected - 1.0;
        assert!(error.abs() <= share, "{what}: {found}, not {expected} (off by {error:.2e})");
    }
}

fn load(name: &str, additions: &Additions) -> scene::Loaded {
    Scene::load_with(&repository(name), additions).unwrap_or_else(|f| panic!("{f}"))
}

fn image_of(scene: Scene, graph: &str, set: &str, size: u32) -> Image {
    let gpu = gpu();
    let project = Project::open(&repository(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.split_whitespace().map(str::to_owned).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { params, size: [size, size], skip: true, ..Settings::default() };
    let mut session = Session::new(&gpu, &project, Arc::new(scene), settings).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    session.image(&gpu, "color").unwrap_or_else(|f| panic!("{f}"))
}

/// A convex matte body under a uniform sky of radiance 1 sends back its albedo, everywhere and in every direction.
#[test]
fn a_ball_under_a_uniform_sky_shows_its_albedo() {
    for (graph, set, share) in [
        ("graphs/gi/pathtrace.ron", "samples=2048", 0.002),
        // The smooth ball's facets hide up to 0.06 % of the sky from its shading normals.
        ("graphs/gi/direct.ron", "environment_samples=256", 0.002),
        ("graphs/gi/first_bounce.ron", "environment_samples=256", 0.002),
    ] {
        let shot = Shot { set, ..Shot::new(graph, "scenes/sky_ball.ron", 24) };
        let [image] = shot.render(["color"]);
        close(middle(&image), ALBEDO, share, graph);
        let corner = image.pixel(0, 0, 0).unwrap_or_default();
        assert!(corner[..3].iter().all(|v| (v - 1.0).abs() < 1e-6), "{graph}: the sky is {corner:?}");
    }
}

/// The first bounce of the sky is direct light in every graph, by as many rays as it takes; there is no other light.
#[test]
fn the_sky_is_direct_light_in_every_graph() {
    let set = "environment_samples=64";
    for name in ["uniform_grid", "fast_grid", "facing_probes", "raycast_capture", "first_bounce", "final_gather"] {
        let graph = format!("graphs/gi/{name}.ron");
        let [direct, color] = Shot { set, ..Shot::new(&graph, "scenes/sky_ball.ron", 24) }.render(["direct", "color"]);
        close(middle(&direct), ALBEDO, 0.01, name);
        let share = middle(&color)[0] / ALBEDO[0];
        assert!((0.99..1.1).contains(&share), "{name}: {share}");
    }
}

/// A surface under a sun of E lux, h high: albedo / pi * E * sin h.
#[test]
fn a_sun_gives_its_illuminance_by_the_sine_of_its_height() {
    for (azimuth, elevation, lux) in [(0.0, 90.0, 3.0), (135.0, 30.0, 68_000.0)] {
        let sun = AddedLight::Sun { azimuth, elevation, lux, color: [1.0; 3] };
        let camera = AddedCamera { at: [4.0, 3.0, 4.0], look_at: Some([4.0, 0.0, 4.0]), fov: 20.0 };
        let additions = Additions {
            lights: vec![("sun".into(), sun)],
            cameras: vec![("above".into(), camera)],
            ..Additions::default()
        };
        let loaded = load("scenes/yard.glb", &additions);
        assert!(loaded.notices.is_empty(), "{}", render(&loaded.notices));
        let image = image_of(loaded.scene, "graphs/gi/direct.ron", "", 16);
        let e = f64::from(lux) * f64::from(elevation).to_radians().sin() / f64::from(PI);
        close(middle(&image), [0.55, 0.52, 0.48].map(|k| k * e), 1e-3, &format!("{elevation}°"));
    }
}

/// Bearings go from north (−Z) by east (+X); a camera looks where it is told, and what is level stays so.
#[test]
fn suns_and_cameras_stand_where_they_are_told() {
    let sun = AddedLight::Sun { azimuth: 90.0, elevation: 30.0, lux: 1.0, color: [1.0; 3] };
    let camera = AddedCamera { at: [1.0, 2.0, 3.0], look_at: Some([4.0, 1.0, -2.0]), fov: 35.0 };
    let additions = Additions {
        lights: vec![("sun".into(), sun)],
        cameras: vec![("there".into(), camera)],
        ..Additions::default()
    };
    let scene = load("scenes/hall.glb", &additions).scene;
    let pose = scene.pose(0.0);
    let light = scene.lights.iter().position(|l| l.kind == LightKind::Directional).unwrap();
    let towards = Vec3::new(30f32.to_radians().cos(), 0.5, 0.0);
    assert!((pose.lights[light].direction + towards).length() < 1e-5, "{}", pose.lights[light].direction);
    // The command's camera goes before the scene's own.
    let (view, name) = scene.view(&pose, None, 1.0).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(name, Some("there"));
    let forward = (Vec3::new(4.0, 1.0, -2.0) - Vec3::new(1.0, 2.0, 3.0)).normalize();
    assert!((view.place.position - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-5);
    assert!((view.place.forward - forward).length() < 1e-5, "{}", view.place.forward);
    let right = view.place.forward.cross(view.place.up);
    assert!(right.y.abs() < 1e-5 && view.place.up.y > 0.0, "{right}");
}

#[test]
fn a_scene_without_light_gets_some_and_says_so() {
    let loaded = load("scenes/yard.glb", &Additions::default());
    let text = render(&loaded.notices);
    for word in ["the scene has no light", "a sun of 3 lx", "clear sky", "--no-default-light"] {
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    }
    assert_eq!(loaded.scene.facts()["directional_lights"], Value::Uint(1));
    assert!(loaded.scene.environment.is_some());
    let image = image_of(loaded.scene, "graphs/gi/direct.ron", "", 32);
    let mean = middle(&image);
    assert!(mean.iter().all(|v| (0.05..2.0).contains(v)), "{mean:?}");
    let dark = load("scenes/yard.glb", &Additions { no_default_light: true, ..Additions::default() });
    assert!(render(&dark.notices).contains("everything will be black"));
    assert!(dark.scene.lights.is_empty() && dark.scene.environment.is_none());
}

#[test]
fn light_of_any_kind_is_enough() {
    let constant = AddedEnvironment::Constant { radiance: [0.5; 3] };
    let loaded = load("scenes/yard.glb", &Additions { environment: Some(constant), ..Additions::default() });
    assert!(loaded.scene.lights.is_empty());
    assert_eq!(loaded.scene.environment.unwrap().mean(), Vec3::splat(0.5));
    for name in ["scenes/furnace.glb", "scenes/cornell.glb", "scenes/sky_ball.ron"] {
        let loaded = load(name, &Additions::default());
        assert!(loaded.notices.is_empty(), "{name}: {}", render(&loaded.notices));
    }
}

/// A room without light and camera: a lamp, and a place to stand.
#[test]
fn a_closed_room_gets_a_lamp_and_a_place_inside() {
    let scratch = Scratch::new("dark-room");
    let path = scratch.path().join("room.glb");
    let bytes = std::fs::read(repository("scenes/empty_room.glb")).unwrap();
    // The names of the lists, so that they are no longer found.
    let text = [
        (&b"\"cameras\""[..], &b"\"cameraz\""[..]),
        (b"\"lights\"", b"\"lightz\""),
        (b"\"camera\"", b"\"camerz\""),
        (b"KHR_lights_punctual", b"XXX_lights_punctual"),
    ];
    let bytes = text.iter().fold(bytes, |bytes, (from, to)| replaced(&bytes, from, to));
    std::fs::write(&path, bytes).unwrap();
    let loaded = Scene::load(&path).unwrap_or_else(|f| panic!("{f}"));
    let text = render(&loaded.notices);
    for word in ["it is a room, and one stands inside", "closed room, and a lamp"] {
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    }
    let scene = loaded.scene;
    let at = scene.pose(0.0).cameras[0].position;
    assert!(at.cmpgt(scene.bounds.min).all() && at.cmplt(scene.bounds.max).all(), "{at}");
    let image = image_of(scene, "graphs/gi/fast_grid.ron", "", 24);
    let mean = middle(&image);
    assert!(mean.iter().all(|v| (0.05..4.0).contains(v)), "{mean:?}");
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    while let Some(at) = out.windows(from.len()).position(|w| w == from) {
        out[at..at + from.len()].copy_from_slice(to);
    }
    out
}

/// What lies under the open sky is looked at from outside.
#[test]
fn only_rooms_are_stood_in() {
    let loaded = load("scenes/yard.glb", &Additions::default());
    assert!(loaded.scene.cameras.is_empty(), "{}", render(&loaded.notices));
}

/// A wall that faces −Z would show nothing to a camera before it.
#[test]
fn what_shows_only_backs_is_looked_at_from_the_other_side() {
    let scratch = Scratch::new("turned");
    let corners: [[f32; 3]; 3] = [[-1.0, 0.0, 0.0], [-1.0, 2.0, 0.0], [1.0, 0.0, 0.0]];
    let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(scratch.path().join("wall.bin"), &bytes).unwrap();
    let wall = |sides: &str| {
        let path = scratch.path().join("wall.gltf");
        let text = format!(
            r#"{{"asset": {{"version": "2.0"}}, "scenes": [{{"nodes": [0]}}], "nodes": [{{"mesh": 0}}],
                "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "material": 0}}]}}],
                "materials": [{{"doubleSided": {sides}}}], "buffers": [{{"uri": "wall.bin", "byteLength": 36}}],
                "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
                "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                    "min": [-1, 0, 0], "max": [1, 2, 0]}}]}}"#
        );
        std::fs::write(&path, text).unwrap();
        Scene::load(&path).unwrap_or_else(|f| panic!("{f}"))
    };
    let turned = wall("false");
    let text = render(&turned.notices);
    assert!(text.contains("from +Z only backs would show"), "{text}");
    let (view, _) = turned.scene.view(&turned.scene.pose(0.0), None, 1.0).unwrap_or_else(|f| panic!("{f}"));
    assert!(view.place.position.z < -1.0 && view.place.forward.z > 0.9, "{view:?}");
    assert!(wall("true").scene.cameras.is_empty(), "both sides show");
}

/// The camera looks through the backs of single-sided surfaces in every graph; light does not pass them.
#[test]
fn the_camera_looks_through_backs() {
    // From outside, through the wall behind, to the wall before: both give 1.
    let camera = AddedCamera { at: [0.0, 0.5, 9.0], look_at: Some([0.0, 0.5, 0.0]), fov: 3.0 };
    let additions = Additions { cameras: vec![("outside".into(), camera)], ..Additions::default() };
    for (graph, set) in [("graphs/gi/pathtrace.ron", "bounces=0"), ("graphs/gi/direct.ron", "")] {
        let image = image_of(load("scenes/furnace.glb", &additions).scene, graph, set, 8);
        let centre = middle(&image)[0];
        assert!(centre >= 1.0, "{graph}: {centre}");
    }
}

#[test]
fn files_of_other_kinds_are_told_what_would_do() {
    let scratch = Scratch::new("other-kind");
    let path = scratch.path().join("model.obj");
    std::fs::write(&path, "v 0 0 0\n").unwrap();
    let text = Scene::load(&path).expect_err("no scene").to_string();
    for word in ["model.obj is no scene", "export it as glTF 2.0"] {
        assert!(text.contains(word), "no `{word}` in:\n{text}");
    }
}

/// Everything that the scene RON says of light and cameras, rendered.
#[test]
fn a_scene_file_brings_lights_cameras_and_a_sky() {
    let loaded = load("scenes/yard_evening.ron", &Additions::default());
    assert!(loaded.notices.is_empty(), "{}", render(&loaded.notices));
    let scene = loaded.scene;
    let names: Vec<&str> = scene.lights.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["sun", "lamp"]);
    assert_eq!(scene.cameras.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["gate", "corner"]);
    assert_eq!(scene.default_camera, Some(0));
    let image = image_of(scene, "graphs/gi/fast_grid.ron", "", 24);
    assert!(middle(&image).iter().all(|v| *v > 0.01), "{:?}", middle(&image));
}

/// A scene file's faults have their places and say what would do.
#[test]
fn what_a_scene_file_says_wrongly_is_shown_where_it_stands() {
    for (entry, words) in [
        (r#"lights: {"a": Sum(azimuth: 0, elevation: 9, lux: 1)}"#, ["unknown kind `Sum`", "did you mean `Sun`?"]),
        (r#"lights: {"a": Sun(azimuth: 0, elevation: 91, lux: 1)}"#, ["elevation 91", "from -90 to 90"]),
        (r#"lights: {"a": Sun(azimuth: 0, elevation: 9)}"#, ["`lux` is missing", "test.ron"]),
        (r#"lights: {"a": Point(at: (0, 1, 0), candela: -1)}"#, ["\"a\": strength -1", "not negative"]),
        (r#"lights: {"a": Spot(at: (0, 1, 0), look_at: (0, 1, 0), candela: 1, angle: 9)}"#, ["same place", "test.ron"]),
        (
            r#"lights: {"ground": Point(at: (0, 1, 0), candela: 1)}"#,
            ["has a node called \"ground\" already", "a name of its own"],
        ),
        (r#"cameras: {"c": (at: (0, 1, 0), fov: 180)}"#, ["180 degrees", "between 0 and 180"]),
        (r#"cameras: {"c": (at: (0, 1, 0), lookat: (0, 0, 0))}"#, ["unknown key `lookat`", "did you mean `look_at`?"]),
        (r#"environment: File(file: "none.hdr")"#, ["none.hdr", "can't read"]),
        (r#"environment: File(file: "sky.png")"#, ["sky.png", ".hdr or .exr"]),
        (r#"environment: Sky(turbidity: 0)"#, ["turbidity 0", "from 1.9"]),
        (r#"environment: Constant(radiance: (1, -1, 1))"#, ["environment", "not negative"]),
        (r#"environment: Fog()"#, ["unknown kind `Fog`", "Constant, Sky, File"]),
        (r#"default_light: 1"#, ["test.ron", "bool"]),
    ] {
        let scratch = Scratch::new("scene-file");
        let path = scratch.path().join("test.ron");
        std::fs::copy(repository("scenes/yard.glb"), scratch.path().join("test.glb")).unwrap();
        std::fs::write(&path, format!("Scene(\n    gltf: \"test.glb\",\n    {entry},\n)\n")).unwrap();
        let text = Scene::load(&path).expect_err(entry).to_string();
        for word in words {
            assert!(text.contains(word), "no `{word}` of {entry} in:\n{text}");
        }
        assert!(text.contains("test.ron:3"), "{entry} has no place:\n{text}");
    }
}
