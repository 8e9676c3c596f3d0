//! The graphs that trace rays: against the references, and against the same by rasterisation.

use crate::device::{self, Shot};
use crate::support::{Scratch, repository};
use lightgraph::Image;
use lightgraph::internals::image::exr::read_exr;
use lightgraph::internals::image::mask::{both, edge_mask, gradient_mask, grow};
use lightgraph::internals::image::metrics::{Metrics, compare};
use std::f32::consts::PI;
use std::path::Path;

const SIZE: u32 = 128;

fn reference(name: &str) -> Image {
    read_exr(&repository(&format!("tests/references/{name}.exr"))).unwrap_or_else(|f| panic!("{f}"))
}

pub fn compared(test: &Image, expected: &Image, mask: Option<&[bool]>) -> Metrics {
    compare(test, expected, mask).unwrap_or_else(|f| panic!("{f}"))
}

/// Direct light of an emissive rectangle within 1 %, two pixels round edges of surfaces and shadows left out.
#[test]
fn an_area_light_agrees_with_the_reference() {
    let [direct] = Shot::new("graphs/gi/direct.ron", "scenes/room_area.gltf", SIZE).render(["direct"]);
    let expected = reference("room_area_direct");
    let [normal, depth, albedo] = ["normal", "depth", "albedo"].map(|what| reference(&format!("room_area_{what}")));
    let mask = edge_mask(&normal, &depth, &albedo)
        .and_then(|surfaces| Ok(both(&surfaces, &gradient_mask(&expected, 0.15)?)))
        .and_then(|mask| grow(&mask, SIZE, SIZE, 2))
        .unwrap_or_else(|f| panic!("{f}"));
    let metrics = compared(&direct, &expected, Some(&mask));
    println!("room_area direct: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.pixels > 8_000, "only {} pixels are compared", metrics.pixels);
    assert!(metrics.rmse_percent <= 1.0 && metrics.bias_percent.abs() <= 0.2, "{metrics:?}");
}

/// The sun's shadows, traced in every graph, in means over 8×8 pixels; shadow maps left 5.7 % there. Pixels at a shadow's
/// edge fall to either side.
#[test]
fn shadows_of_the_sun_agree_with_the_reference() {
    let expected = reference("atrium_direct");
    for graph in ["direct", "fast_grid", "final_gather"] {
        let path = format!("graphs/gi/{graph}.ron");
        let [direct] = Shot::new(&path, "scenes/atrium.ron", SIZE).render(["direct"]);
        let metrics = compared(&direct, &expected, None);
        let blocks = metrics.block_rmse_percent;
        println!("atrium direct by {graph}: 8×8 means {blocks:.3} %, bias {:+.3} %", metrics.bias_percent);
        assert!(blocks <= 1.0 && metrics.bias_percent.abs() <= 0.1, "{graph}: {metrics:?}");
    }
}

/// A scene of matte and of emissive quads, counter-clockwise from the front, seen from `height` metres above the
/// origin.
pub fn lit_by(lamps: &[Quad], matte: &[Quad], height: f32, folder: &Path) -> String {
    let quads = || matte.iter().chain(lamps);
    let mut bytes: Vec<u8> = quads().flatten().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let from = bytes.len();
    for first in (0..quads().count() as u32).map(|quad| 4 * quad) {
        bytes.extend([0, 1, 2, 0, 2, 3].iter().flat_map(|i| (first + i).to_le_bytes()));
    }
    let (vertices, length) = (4 * quads().count(), bytes.len());
    let bound = |of: fn(f32, f32) -> f32| [0, 1, 2].map(|i| quads().flatten().map(|c| c[i]).reduce(of).unwrap());
    let (low, high) = (bound(f32::min), bound(f32::max));
    let (plain, bright) = (6 * matte.len(), 6 * lamps.len());
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0, 1]}}],
        "nodes": [
            {{"mesh": 0}},
            {{"camera": 0, "translation": [0, {height}, 0], "rotation": [-0.70710678, 0, 0, 0.70710678]}}
        ],
        "cameras": [{{"type": "perspective", "perspective": {{"yfov": 1.5, "znear": 0.01}}}}],
        "materials": [{{"pbrMetallicRoughness": {{"metallicFactor": 0}}}}, {{"emissiveFactor": [1, 1, 1]}}],
        "meshes": [{{"primitives": [
            {{"attributes": {{"POSITION": 0}}, "indices": 1, "material": 0}},
            {{"attributes": {{"POSITION": 0}}, "indices": 2, "material": 1}}
        ]}}],
        "accessors": [
            {{"bufferView": 0, "componentType": 5126, "count": {vertices}, "type": "VEC3",
              "min": {low:?}, "max": {high:?}}},
            {{"bufferView": 1, "componentType": 5125, "count": {plain}, "type": "SCALAR"}},
            {{"bufferView": 1, "byteOffset": {}, "componentType": 5125, "count": {bright}, "type": "SCALAR"}}
        ],
        "bufferViews": [
            {{"buffer": 0, "byteLength": {from}}},
            {{"buffer": 0, "byteOffset": {from}, "byteLength": {}}}
        ],
        "buffers": [{{"byteLength": {length}, "uri": "lit.bin"}}]}}"#,
        4 * plain,
        length - from
    );
    std::fs::write(folder.join("lit.bin"), bytes).unwrap();
    let path = folder.join("lit.gltf");
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// Its corners.
pub type Quad = [[f32; 3]; 4];

/// Four metres wide.
pub const FLOOR: Quad = [[-2.0, 0.0, -2.0], [-2.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, -2.0]];

/// At one side of the floor, two metres high.
pub const WALL: Quad = [[-2.0, 0.0, 2.0], [-2.0, 0.0, -2.0], [-2.0, 2.0, -2.0], [-2.0, 2.0, 2.0]];

/// At all four sides of the floor.
pub fn around(side: Quad) -> impl Iterator<Item = Quad> {
    let turn = |quad: &Quad| Some(quad.map(|[x, y, z]| [z, y, -x]));
    std::iter::successors(Some(side), turn).take(4)
}

/// Faces down.
pub fn ceiling([low_x, high_x]: [f32; 2], [low_z, high_z]: [f32; 2], height: f32) -> Quad {
    [[low_x, height, low_z], [high_x, height, low_z], [high_x, height, high_z], [low_x, height, high_z]]
}

/// A lamp of one metre above the floor, cut into `n` × `n` squares.
fn lamp_of_squares(n: u32) -> Vec<Quad> {
    let along = |i: u32| [i as f32, (i + 1) as f32].map(|i| i / n as f32 - 0.5);
    (0..n * n).map(|i| ceiling(along(i / n), along(i % n), 1.0)).collect()
}

/// However finely a lamp is cut, it gives the same light. Of so many triangles a surface looks at some; llvmpipe ends
/// loops after 65,535 rounds, and looking at all left three hundred times the light.
#[test]
fn a_lamp_of_a_hundred_thousand_triangles_gives_what_one_of_two_gives() {
    let folder = Scratch::new("fine-lamp");
    let of = |n: u32| {
        let scene = lit_by(&lamp_of_squares(n), &[FLOOR], 0.9, folder.path());
        let [direct] = Shot::new("graphs/gi/direct.ron", &scene, 24).render(["direct"]);
        direct
    };
    let metrics = compared(&of(240), &of(1), None);
    println!("115,200 triangles: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.mean_reference > 0.1, "the floor is lit");
    assert!(metrics.rmse_percent <= 0.5 && metrics.bias_percent.abs() <= 0.1, "{metrics:?}");
}

/// Direct light of emissive quads on the floor is that of the path tracer on the mean.
fn agrees_with_paths(what: &str, lamps: &[Quad], matte: &[Quad], height: f32) {
    let folder = Scratch::new(what);
    let scene = lit_by(lamps, matte, height, folder.path());
    let set = "samples=512 bounces=0";
    let [expected] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", &scene, 48) }.render(["direct"]);
    let [direct] = Shot::new("graphs/gi/direct.ron", &scene, 48).render(["direct"]);
    let metrics = compared(&direct, &expected, None);
    println!("{what}: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.mean_reference > 0.01, "the floor is lit");
    assert!(metrics.bias_percent.abs() <= 1.0, "{what}: {metrics:?}");
}

/// The first points on a lamp may all be hidden where a fifth of it is seen.
#[test]
fn a_lamp_behind_a_grate_lights_what_it_shows() {
    let slat = |i: u32| ceiling([0.2, 0.36].map(|x| x + 0.2 * i as f32 - 2.0), [-2.0, 2.0], 0.5);
    let matte: Vec<Quad> = std::iter::once(FLOOR).chain((0..19).map(slat)).collect();
    agrees_with_paths("grate", &lamp_of_squares(1), &matte, 0.4);
}

/// Lamps that are below a surface but for their edges give it next to nothing, and take nothing from what others give.
#[test]
fn lamps_across_the_horizon_leave_the_light_of_others() {
    let sunk = |i: u32| {
        let z = [0.0, 0.1].map(|z| z + 0.1 * i as f32 - 1.5);
        [[1.5, -1.0, z[0]], [1.5, -1.0, z[1]], [1.5, 0.02, z[1]], [1.5, 0.02, z[0]]]
    };
    let lamps: Vec<Quad> = lamp_of_squares(2).into_iter().chain((0..30).map(sunk)).collect();
    agrees_with_paths("horizon", &lamps, &[FLOOR], 0.9);
}

/// Where the cache has no room for a place that rays meet, what others met beside it stands for its light: half of it
/// was lost.
#[test]
fn a_cache_without_room_keeps_the_light_of_emitters() {
    let folder = Scratch::new("full-cache");
    let file = folder.path().join("small.ron");
    let variant = r#"Variant(base: "lightgraph:graphs/gi/final_gather.ron", lets: {"places": "512"})"#;
    std::fs::write(&file, variant).unwrap();
    let path = file.display().to_string();
    let [indirect] = Shot::new(&path, "scenes/room_area.gltf", SIZE).render(["indirect"]);
    let metrics = compared(&indirect, &reference("room_area_indirect"), None);
    println!("full cache: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.bias_percent.abs() <= 12.0, "{metrics:?}");
}

/// A floor and the back of another one lie in one place, cut along different diagonals: rays meet the floor, as the
/// rasteriser does. Rounding chose between them, and parts of the floor were black.
#[test]
fn a_back_in_the_place_of_a_front_hides_nothing() {
    let folder = Scratch::new("two-in-one");
    let tilted @ [a, b, c, d] = FLOOR.map(|[x, _, z]| [x, 0.13 * x + 0.07 * z, z]);
    let of = |matte: &[Quad]| {
        let scene = lit_by(&[ceiling([-1.0, 1.0], [-1.0, 1.0], 1.0)], matte, 0.9, folder.path());
        let [color] = Shot { set: "samples=16", ..Shot::new("graphs/gi/pathtrace.ron", &scene, 48) }.render(["color"]);
        color
    };
    let metrics = compared(&of(&[tilted, [b, a, d, c]]), &of(&[tilted]), None);
    println!("two in one place: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.mean_reference > 0.1, "the floor is lit");
    assert!(metrics.rmse_percent <= 0.1, "{metrics:?}");
}

/// A surface that is all hole takes none of a lamp's light: cells of the cache took it as whole.
#[test]
fn a_hole_before_a_lamp_takes_nothing() {
    let folder = Scratch::new("hole");
    let text = std::fs::read_to_string(repository("scenes/room_area.gltf")).unwrap();
    let mut scene: serde_json::Value = serde_json::from_str(&text).unwrap();
    let number = |rows: &serde_json::Value| rows.as_array().unwrap().len();
    let [node, material, hole] = ["nodes", "materials", "meshes"].map(|what| number(&scene[what]));
    let mut mesh = scene["meshes"][1].clone();
    mesh["primitives"][0]["material"] = material.into();
    scene["nodes"].as_array_mut().unwrap().push(serde_json::json!({
        "mesh": hole, "translation": [0, -0.2, 0]
    }));
    scene["meshes"].as_array_mut().unwrap().push(mesh);
    scene["scenes"][0]["nodes"].as_array_mut().unwrap().push(node.into());
    scene["materials"].as_array_mut().unwrap().push(serde_json::json!({
        "alphaMode": "MASK", "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0], "metallicFactor": 0}
    }));
    let file = folder.path().join("hole.gltf");
    std::fs::write(&file, scene.to_string()).unwrap();
    let [indirect] = Shot::new("graphs/gi/final_gather.ron", &file.display().to_string(), SIZE).render(["indirect"]);
    let metrics = compared(&indirect, &reference("room_area_indirect"), None);
    println!("hole: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.bias_percent.abs() <= 1.5, "{metrics:?}");
}

/// The normals of a furrowed floor all point up. Light still goes by how its triangles lie: the two sides of a furrow
/// light each other, though by their normals neither sees the other.
#[test]
fn smooth_normals_on_coarse_triangles_change_no_light() {
    let folder = Scratch::new("furrows");
    let side = |i: u32| {
        let [x, next] = [i, i + 1].map(|i| 0.25 * i as f32 - 2.0);
        let [y, after] = [i, i + 1].map(|i| 0.1 * (i % 2) as f32);
        [[x, y, -2.0], [x, y, 2.0], [next, after, 2.0], [next, after, -2.0]]
    };
    let floor: Vec<Quad> = (0..16).map(side).collect();
    let file = lit_by(&lamp_of_squares(1), &floor, 0.9, folder.path());
    let mut scene: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    let vertices = scene["accessors"][0]["count"].as_u64().unwrap() as usize;
    let up = [0.0_f32, 1.0, 0.0].map(f32::to_le_bytes).concat().repeat(vertices);
    let mut add = |list: &str, what: serde_json::Value| scene[list].as_array_mut().unwrap().push(what);
    add("buffers", serde_json::json!({"byteLength": up.len(), "uri": "up.bin"}));
    add("bufferViews", serde_json::json!({"buffer": 1, "byteLength": up.len()}));
    add("accessors", serde_json::json!({"bufferView": 2, "componentType": 5126, "count": vertices, "type": "VEC3"}));
    scene["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 3.into();
    for (material, color) in [0.8, 0.0].into_iter().enumerate() {
        scene["materials"][material]["pbrMetallicRoughness"] =
            serde_json::json!({"metallicFactor": 0, "baseColorFactor": [color, color, color, 1]});
    }
    std::fs::write(folder.path().join("up.bin"), up).unwrap();
    std::fs::write(&file, scene.to_string()).unwrap();
    let set = "samples=1024";
    let [expected] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", &file, 48) }.render(["indirect"]);
    // Pixels with the same normal share rays, though the other side of a furrow sees other things.
    let set = "rays=64 reach=0";
    let [indirect] = Shot { set, ..Shot::new("graphs/gi/final_gather.ron", &file, 48) }.render(["indirect"]);
    let metrics = compared(&indirect, &expected, None);
    println!("furrows: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.mean_reference > 5e-4, "the floor is lit");
    assert!(metrics.bias_percent.abs() <= 2.0, "{metrics:?}");
}

/// Through a window in the roof the sky lights the floor. Few rays find it by chance, many by the directions in which
/// others did: without those 8×8 means are 33 % off.
#[test]
fn the_sky_lights_a_room_through_a_window() {
    let folder = Scratch::new("window");
    let roof = ceiling([-2.0, 0.25], [-2.0, -0.25], 2.0);
    let room: Vec<Quad> = std::iter::once(FLOOR).chain(around(WALL)).chain(around(roof)).collect();
    lit_by(&[], &room, 1.9, folder.path());
    let file = folder.path().join("window.ron");
    std::fs::write(&file, r#"Scene(gltf: "lit.gltf", environment: Constant(radiance: (1, 1, 1)))"#).unwrap();
    let scene = file.display().to_string();
    let set = "samples=64 bounces=0";
    let [expected] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", &scene, 48) }.render_frames(32, ["direct"]);
    let [direct] = Shot::new("graphs/gi/final_gather.ron", &scene, 48).render(["direct"]);
    let metrics = compared(&direct, &expected, None);
    let blocks = metrics.block_rmse_percent;
    println!("window: 8×8 means {blocks:.3} %, bias {:+.3} %", metrics.bias_percent);
    assert!(metrics.mean_reference > 5e-3, "the floor is lit");
    assert!(blocks <= 25.0 && metrics.bias_percent.abs() <= 5.0, "{metrics:?}");
}

/// Three tubes of twelve long sides just above the floor have more triangles than a pixel asks. Points close to a
/// triangle but far from its middle asked it too seldom: single pixels were too bright, and the rmse was 269 %.
#[test]
fn long_tubes_above_a_floor_light_it_evenly() {
    let corner = |tube: u32, i: u32, z| {
        let angle = i as f32 / 6.0 * PI;
        [tube as f32 - 1.0 + 0.015 * angle.cos(), 0.03 + 0.015 * angle.sin(), z]
    };
    let side = |tube, i| [(i, -0.8), (i + 1, -0.8), (i + 1, 0.8), (i, 0.8)].map(|(i, z)| corner(tube, i, z));
    let tubes: Vec<Quad> = (0..36).map(|i| side(i / 12, i % 12)).collect();
    let folder = Scratch::new("tubes");
    let room: Vec<Quad> = std::iter::once(FLOOR).chain(around(WALL)).collect();
    let file = lit_by(&tubes, &room, 1.9, folder.path());
    let set = "samples=1024 bounces=0";
    let [expected] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", &file, 48) }.render(["direct"]);
    let [direct] = Shot::new("graphs/gi/final_gather.ron", &file, 48).render(["direct"]);
    let metrics = compared(&direct, &expected, None);
    println!("tubes: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
    assert!(metrics.mean_reference > 1e-3, "the floor is lit");
    assert!(metrics.rmse_percent <= 20.0 && metrics.bias_percent.abs() <= 2.0, "{metrics:?}");
}

/// Light goes to and fro between a bright slab and the white ceiling close above it, so that of what bounces add each
/// second one is more. Where the last of them alone told what would come, this room was 34 % too dark, others far too
/// bright.
#[test]
fn light_that_goes_to_and_fro_does_not_run_away() {
    let folder = Scratch::new("slab");
    let below = ceiling([-1.0, 1.0], [-1.0, 1.0], 1.892);
    let mut above = below.map(|[x, y, z]| [x, y + 0.04, z]);
    above.reverse();
    let roof = ceiling([-2.0, 2.0], [-2.0, 2.0], 2.0);
    let room: Vec<Quad> = [FLOOR, roof].into_iter().chain(around(WALL)).collect();
    let file = lit_by(&[below, above], &room, 1.8, folder.path());
    let mut scene: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    for material in scene["materials"].as_array_mut().unwrap() {
        material["pbrMetallicRoughness"] =
            serde_json::json!({"metallicFactor": 0, "baseColorFactor": [0.97, 0.97, 0.97, 1]});
    }
    std::fs::write(&file, scene.to_string()).unwrap();
    let mean = |graph, set| {
        let [image] = Shot { set, ..Shot::new(graph, &file, 48) }.render(["indirect"]);
        image.rgb().map(|p| f64::from(p[0])).sum::<f64>() / f64::from(48 * 48)
    };
    let expected = mean("graphs/gi/pathtrace.ron", "samples=64 bounces=512");
    let found = mean("graphs/gi/final_gather.ron", "");
    println!("to and fro: {found:.3}, by paths {expected:.3}");
    assert!((found / expected - 1.0).abs() <= 0.2, "{found}, not {expected}");
}

/// A lamp shows a picture that is bright in one corner. Most of its light comes back from a shelf half a metre away.
/// Where all points of the lamp counted alike, 8×8 means were 26 % off.
#[test]
fn a_lamp_that_shows_a_picture_sends_light_from_where_it_is_bright() {
    let folder = Scratch::new("picture");
    let lamp = ceiling([-0.5, 0.5], [-0.5, 0.5], 1.0).map(|[x, y, z]| [x, y, -z]);
    let roof = ceiling([-2.0, 2.0], [-2.0, 2.0], 2.0);
    let shelf = ceiling([-0.7, 0.7], [-0.7, 0.7], 1.4);
    let room: Vec<Quad> = [FLOOR, roof, shelf].into_iter().chain(around(WALL)).collect();
    let file = lit_by(&[lamp], &room, 1.9, folder.path());
    let mut scene: serde_json::Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    let vertices = scene["accessors"][0]["count"].as_u64().unwrap() as usize;
    let corners = [[0.0_f32, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].as_flattened();
    let uvs = corners.repeat(vertices / 4).iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let bright = |x: u32| (2..6).contains(&x);
    let texel = |x, y| image::Rgb([if bright(x) && bright(y) { 255 } else { 20 }; 3]);
    image::RgbImage::from_fn(16, 16, texel).save(folder.path().join("picture.png")).unwrap();
    let mut add = |list: &str, what: serde_json::Value| scene[list].as_array_mut().unwrap().push(what);
    add("buffers", serde_json::json!({"byteLength": uvs.len(), "uri": "uvs.bin"}));
    add("bufferViews", serde_json::json!({"buffer": 1, "byteLength": uvs.len()}));
    add("accessors", serde_json::json!({"bufferView": 2, "componentType": 5126, "count": vertices, "type": "VEC2"}));
    scene["images"] = serde_json::json!([{"uri": "picture.png"}]);
    scene["textures"] = serde_json::json!([{"source": 0}]);
    scene["materials"][1] = serde_json::json!({
        "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.0, 0.0, 0.0, 1.0]},
        "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}
    });
    scene["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = serde_json::json!([0.7, 0.7, 0.7, 1.0]);
    scene["meshes"][0]["primitives"][1]["attributes"]["TEXCOORD_0"] = 3.into();
    std::fs::write(folder.path().join("uvs.bin"), uvs).unwrap();
    std::fs::write(&file, scene.to_string()).unwrap();
    let set = "samples=1024";
    let [expected] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", &file, 48) }.render(["indirect"]);
    let [indirect] = Shot::new("graphs/gi/final_gather.ron", &file, 48).render(["indirect"]);
    let metrics = compared(&indirect, &expected, None);
    let blocks = metrics.block_rmse_percent;
    println!("picture: 8×8 means {blocks:.3} %, bias {:+.3} %", metrics.bias_percent);
    assert!(metrics.mean_reference > 1e-4, "the room is lit");
    assert!(blocks <= 10.0 && metrics.bias_percent.abs() <= 5.0, "{metrics:?}");
}

/// In a closed room of albedo ρ whose walls emit 1, n bounces after the first give the sum of ρᵏ up to k = n + 1.
#[test]
fn a_furnace_gives_its_closed_form() {
    let [direct] = Shot { set: "emitter_samples=4", ..Shot::new("graphs/gi/direct.ron", "scenes/furnace_80.glb", 16) }
        .render(["direct"]);
    for x in direct.data.chunks(direct.channels as usize).flat_map(|pixel| &pixel[..3]) {
        assert!((x - 1.8).abs() <= 1e-4, "{x} is not 1 + 0.8");
    }
    let set = "samples=1024 bounces=6";
    let [color] = Shot { set, ..Shot::new("graphs/gi/pathtrace.ron", "scenes/furnace_80.glb", 32) }.render(["color"]);
    let pixels = color.pixel_count();
    let channels = color.data.chunks(color.channels as usize).flat_map(|pixel| &pixel[..3]);
    let mean = channels.map(|x| f64::from(*x)).sum::<f64>() / (3 * pixels) as f64;
    let expected: f64 = (0..8).map(|k| 0.8_f64.powi(k)).sum();
    println!("furnace: {mean:.5}, on paper {expected:.5}");
    // Five standard errors: over seeds, images of 64 paths a pixel differ by 0.16 %.
    assert!((mean / expected - 1.0).abs() <= 0.002, "{mean} is not {expected}");
}

#[test]
fn more_frames_are_less_noise() {
    let shot = Shot { set: "samples=4", ..Shot::new("graphs/gi/pathtrace.ron", "scenes/room_spot.gltf", SIZE) };
    let expected = reference("room_spot_indirect");
    let error = |frames: u32| {
        let [image] = shot.render_frames(frames, ["indirect"]);
        compared(&image, &expected, None).rmse_percent
    };
    let (one, sixteen) = (error(1), error(16));
    println!("rmse of 1 frame {one:.1} %, of 16 {sixteen:.1} %");
    // 4 but for the noise of the estimates themselves.
    assert!((3.3..=4.7).contains(&(one / sixteen)), "rmse of 1 frame {one:.1} %, of 16 {sixteen:.1} %");
}

/// With 4×4×4 probes in a cube, texels look exactly into its corners: rays give them to the triangle that drawing
/// covers them with. What is left lies along edges that rounding moves across a texel's centre. With another number
/// along each axis no texel looks there.
#[test]
fn probes_captured_by_rays_are_those_drawn() {
    for (scene, grid, most) in [
        ("cornell_point", "4,4,4", 0.25),
        ("room_spot", "4,4,4", 0.25),
        ("cornell_point", "4,5,6", 0.1),
        ("room_spot", "4,5,6", 0.1),
    ] {
        let path = format!("scenes/{scene}.gltf");
        let of = |graph: &str| {
            let set = format!("grid={grid} bounces=8 epsilon=0");
            let [image] = Shot { set: &set, ..Shot::new(graph, &path, SIZE) }.render(["indirect"]);
            image
        };
        let metrics = compared(&of("graphs/gi/raycast_capture.ron"), &of("graphs/gi/uniform_grid.ron"), None);
        println!("{scene}, {grid}: rmse {:.4} %, bias {:+.4} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.rmse_percent <= most, "{scene}, {grid}: {metrics:?}");
    }
}

/// Where Chromium has its own Vulkan driver, SwiftShader, which draws several views rightly.
const SWIFTSHADER: [&str; 5] = [
    "/usr/lib/chromium/vk_swiftshader_icd.json",
    "/usr/lib/chromium-browser/vk_swiftshader_icd.json",
    "/usr/lib64/chromium-browser/vk_swiftshader_icd.json",
    "/opt/google/chrome/vk_swiftshader_icd.json",
    "/snap/chromium/current/usr/lib/chromium-browser/vk_swiftshader_icd.json",
];

/// The same triangles cover the same texels, whether the faces of a probe are drawn one by one or at once. Mesa's
/// llvmpipe loses triangles that it clips, in every view but one: instead of on it, the command runs on SwiftShader.
#[test]
fn probes_captured_through_six_views_are_those_drawn_face_by_face() {
    let driver = device::gpu().info.name.contains("llvmpipe").then(|| {
        let found = SWIFTSHADER.into_iter().find(|path| Path::new(path).exists());
        found
            .unwrap_or_else(|| panic!("no SwiftShader, which comes with Chromium; install it: none of {SWIFTSHADER:?}"))
    });
    let folder = Scratch::new("six-views");
    for scene in ["cornell_point", "room_spot"] {
        let [by_views, by_faces] = ["layered_capture", "uniform_grid"].map(|graph| {
            let out = folder.path().join(format!("{graph}_{scene}.exr"));
            let mut command = crate::support::command();
            command.arg("render").arg(format!("graphs/gi/{graph}.ron"));
            command.arg("--scene").arg(format!("scenes/{scene}.gltf")).args(["--size", "64x64", "--set", "bounces=1"]);
            command.arg("--output").arg(format!("indirect={}", out.display()));
            if let Some(driver) = driver {
                // Both names of the loader's variable, the old and the new.
                command.env("VK_ICD_FILENAMES", driver).env("VK_DRIVER_FILES", driver);
            }
            let output = command.output().unwrap_or_else(|e| panic!("can't start lightgraph: {e}"));
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            read_exr(&out).unwrap_or_else(|f| panic!("{f}"))
        });
        let metrics = compared(&by_views, &by_faces, None);
        println!("{scene}: rmse {:.4} %, bias {:+.4} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.mean_reference > 0.01 && metrics.rmse_percent <= 0.01, "{scene}: {metrics:?}");
    }
}

#[test]
fn a_first_bounce_by_rays_leaves_little_error() {
    for scene in ["cornell_point", "room_spot"] {
        let path = format!("scenes/{scene}.gltf");
        let set = "grid=8,8,8 directions=10";
        let [indirect] = Shot { set, ..Shot::new("graphs/gi/first_bounce.ron", &path, SIZE) }.render(["indirect"]);
        let metrics = compared(&indirect, &reference(&format!("{scene}_indirect")), None);
        println!("{scene}: rmse {:.2} %, bias {:+.2} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.rmse_percent <= 4.0 && metrics.bias_percent.abs() <= 1.0, "{scene}: {metrics:?}");
    }
}

/// One setting for small rooms and for the corridor, where probes behind the hits fail.
#[test]
fn rays_that_pixels_share_and_cells_on_surfaces_leave_little_error() {
    let scenes = [("cornell_point.gltf", 9.0), ("room_spot.gltf", 6.0), ("room_area.gltf", 6.0), ("corridor.glb", 9.0)];
    for (file, most) in scenes {
        let [indirect] = Shot::new("graphs/gi/final_gather.ron", &format!("scenes/{file}"), SIZE).render(["indirect"]);
        let scene = file.split('.').next().unwrap_or(file);
        let metrics = compared(&indirect, &reference(&format!("{scene}_indirect")), None);
        println!("{scene}: rmse {:.2} %, bias {:+.2} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.rmse_percent <= most && metrics.bias_percent.abs() <= 2.0, "{scene}: {metrics:?}");
    }
}
