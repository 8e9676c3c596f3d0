//! Wishes and what comes of them, on the adapter of this machine.

use super::*;
use crate::view::feed::{ResourceContent, ShownScore};
use lightgraph::Image;
use lightgraph::internals::diag::render;
use lightgraph::internals::gpu;
use lightgraph::internals::image::exr::{Precision, write_exr};
use lightgraph::internals::value::Value;
use std::collections::BTreeMap;
use std::fs;

const GRAPH: &str = r#"Graph(
    about: "One colour",
    params: {"red": Float(default: 0.25, min: 0.0, max: 1.0)},
    resources: {
        "color": Texture(format: Rgba32Float, size: "screen"),
        "ramp": Texture(format: R32Float, size: (4, 4), layers: 2),
        "list": Buffer(stride: 4, count: 3),
    },
    passes: [
        Compute(name: "fill", shader: "fill.wgsl", over: "ramp"),
        Screen(name: "paint", shader: "paint.wgsl", color: "color"),
    ],
    outputs: {"color": "color", "list": "list"},
)"#;

const FILL: &str = "
var ramp: texture_storage_2d_array<r32float, write>;
var<storage, read_write> list: array<u32>;
@compute @workgroup_size(4, 4, 1) fn fill(@builtin(global_invocation_id) at: vec3u) {
    textureStore(ramp, at.xy, at.z, vec4f(f32(at.x + 10u * at.z)));
    if all(at == vec3u(0u)) { list[1] = 7u; }
}";

const PAINT: &str = "
var<uniform> red: f32;
var ramp: texture_2d_array<f32>;
@fragment fn paint() -> @location(0) vec4f { return vec4f(red, textureLoad(ramp, vec2u(0u), 0, 0).r, 0.0, 1.0); }";

const VARIANT: &str = r#"Variant(base: "graph.ron", about: "redder", params: {"red": (default: 1.0)})"#;

/// Files of a graph and a variant, removed in the end.
struct Files(PathBuf);

impl Files {
    fn new(name: &str) -> Files {
        let folder = std::env::temp_dir().join(format!("lightgraph-stage-{name}-{}", std::process::id()));
        fs::create_dir_all(folder.join("shaders")).unwrap();
        let files =
            [("graph.ron", GRAPH), ("other.ron", VARIANT), ("shaders/fill.wgsl", FILL), ("shaders/paint.wgsl", PAINT)];
        for (name, text) in files {
            fs::write(folder.join(name), text).unwrap();
        }
        Files(folder)
    }

    fn wish(&self) -> FrameRequest {
        let scene = crate::repository("scenes/lambert_plane.glb");
        let choice = ViewChoice::new(self.0.join("graph.ron"), scene);
        FrameRequest {
            serial: 1,
            choice,
            size: [8, 6],
            time: 0.0,
            pointer: Pointer::default(),
            output: None,
            inspect: None,
            ask: None,
            prepare: false,
            linked: None,
        }
    }
}

impl Drop for Files {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn stage() -> ViewStage {
    let gpu = Gpu::open().unwrap_or_else(|e| panic!("{}", Faults::from(e)));
    ViewStage::new(Arc::new(gpu), vec![], Additions::default(), Policy::First, false)
}

/// Goes on until nothing more comes.
fn settle(stage: &mut ViewStage, wish: &FrameRequest) -> ViewState {
    for _ in 0..10 {
        let told = stage.advance(wish, &mut |_| ());
        if told.rest {
            return told;
        }
    }
    panic!("it does not come to rest");
}

fn pixel(gpu: &Gpu, told: &ViewState) -> [f32; 2] {
    let image = gpu::read_plane(gpu, told.image.as_ref().unwrap(), "image", 0, 0).unwrap();
    let p = image.pixel(0, 3, 3).unwrap();
    [p[0], p[1]]
}

#[test]
fn a_fault_leaves_the_last_good_frame_until_it_is_mended() {
    let (files, mut stage) = (Files::new("fault"), stage());
    let mut wish = files.wish();
    let told = settle(&mut stage, &wish);
    assert!(told.faults.is_empty(), "{}", render(&told.faults));
    assert_eq!(pixel(&stage.gpu, &told), [0.25, 0.0]);

    let shader = files.0.join("shaders/paint.wgsl");
    fs::write(&shader, PAINT.replace("vec4f(red", "vec4f(rod")).unwrap();
    stage.changed(&BTreeSet::from([shader.clone()]));
    let told = settle(&mut stage, &wish);
    assert!(render(&told.faults).contains("paint.wgsl:4:"), "{}", render(&told.faults));
    assert_eq!(pixel(&stage.gpu, &told), [0.25, 0.0]);
    // The last good frame still follows the camera, and the fault stays.
    wish.time = 1.0;
    assert!(!settle(&mut stage, &wish).faults.is_empty());

    fs::write(&shader, PAINT.replace("vec4f(red", "vec4f(0.5 * red")).unwrap();
    stage.changed(&BTreeSet::from([shader]));
    let told = settle(&mut stage, &wish);
    assert!(told.faults.is_empty(), "{}", render(&told.faults));
    assert_eq!(pixel(&stage.gpu, &told), [0.125, 0.0]);
}

#[test]
fn what_is_lit_in_lux_is_exposed_by_itself() {
    let (files, mut stage) = (Files::new("exposed"), stage());
    let mut wish = files.wish();
    // A quarter of one is shown as it is.
    assert_eq!(settle(&mut stage, &wish).automatic, 0.0);
    let shader = files.0.join("shaders/paint.wgsl");
    let bright =
        PAINT.replace("vec4f(red, textureLoad(ramp, vec2u(0u), 0, 0).r, 0.0, 1.0)", "vec4f(vec3f(8e4 * red), 1.0)");
    fs::write(&shader, bright).unwrap();
    stage.changed(&BTreeSet::from([shader]));
    let stops = settle(&mut stage, &wish).automatic;
    assert!((stops - (0.18_f32 / 2e4).log2()).abs() < 1e-3, "{stops}");
    // A choice of the user's is left alone.
    wish.choice.exposure = Exposure::Stops(-3.0);
    assert_eq!(wish.choice.stops(stops), -3.0);
}

/// A frame in which nothing runs changes nothing of what is shown, nor of what is wrong with it.
#[test]
fn checks_that_do_not_hold_are_told_until_they_are_mended() {
    let (files, mut stage) = (Files::new("checks"), stage());
    let wish = files.wish();
    assert!(settle(&mut stage, &wish).checks.is_empty());
    let shader = files.0.join("shaders/paint.wgsl");
    let sound = fs::read_to_string(&shader).unwrap();
    let mut written = |text: &str| {
        fs::write(&shader, text).unwrap();
        stage.changed(&BTreeSet::from([shader.clone()]));
        settle(&mut stage, &wish).checks
    };
    let check = "check(false, vec3u(7u, 0u, 0u), #{HERE}); return ";
    let broken = format!("#import lightgraph::report::{{check}}\n{}", sound.replacen("return ", check, 1));
    let told = written(&broken);
    assert!(render(&told).contains("a check in the shader of `paint` does not hold"), "{}", render(&told));
    let told = written(&sound);
    assert!(told.is_empty(), "{}", render(&told));
}

#[test]
fn numbers_that_should_not_be_are_told_until_they_are_mended() {
    let (files, mut stage) = (Files::new("numbers"), stage());
    stage.watch = true;
    let mut wish = files.wish();
    assert!(settle(&mut stage, &wish).checks.is_empty());
    let written = |stage: &mut ViewStage, text: &str| {
        let shader = files.0.join("shaders/fill.wgsl");
        fs::write(&shader, text).unwrap();
        stage.changed(&BTreeSet::from([shader]));
    };
    written(&mut stage, &FILL.replace("vec4f(f32(at.x + 10u * at.z))", "vec4f(1.0 / f32(at.x))"));
    let told = settle(&mut stage, &wish);
    assert!(render(&told.checks).contains("`fill` leaves numbers in `ramp`"), "{}", render(&told.checks));
    // Nothing of it runs again: it still holds. Another parameter has a session of its own.
    wish.time = 1.0;
    assert!(!settle(&mut stage, &wish).checks.is_empty());
    wish.choice.params.insert("red".into(), Value::Float(0.75));
    assert!(!settle(&mut stage, &wish).checks.is_empty());
    written(&mut stage, FILL);
    let told = settle(&mut stage, &wish);
    assert!(told.checks.is_empty(), "{}", render(&told.checks));
}

#[test]
fn a_picture_beside_the_graph_is_no_change() {
    let (files, mut stage) = (Files::new("beside"), stage());
    let told = settle(&mut stage, &files.wish());
    stage.changed(&BTreeSet::from([files.0.join("graph.png")]));
    let again = settle(&mut stage, &files.wish());
    assert!(Arc::ptr_eq(&told.subject.unwrap(), &again.subject.unwrap()));
    stage.changed(&BTreeSet::from([files.0.join("graph.ron")]));
    assert!(settle(&mut stage, &files.wish()).remade.is_some());
}

#[test]
fn parameters_that_a_variant_lacks_or_refuses_are_left_out() {
    let (files, mut stage) = (Files::new("params"), stage());
    let mut wish = files.wish();
    wish.choice.params = BTreeMap::from([("red".into(), Value::Float(0.75)), ("blue".into(), Value::Float(0.5))]);
    let told = settle(&mut stage, &wish);
    assert!(told.faults.is_empty(), "{}", render(&told.faults));
    assert_eq!(pixel(&stage.gpu, &told)[0], 0.75);
    wish.choice.params.insert("red".into(), Value::Float(7.0));
    assert_eq!(pixel(&stage.gpu.clone(), &settle(&mut stage, &wish))[0], 0.25);
}

#[test]
fn a_variant_that_was_seen_is_shown_at_once() {
    let (files, mut stage) = (Files::new("variant"), stage());
    let mut wish = files.wish();
    let told = settle(&mut stage, &wish);
    let names: Vec<&str> = told.variants.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["graph", "other"]);
    wish.choice.graph = files.0.join("other.ron");
    assert_eq!(pixel(&stage.gpu.clone(), &settle(&mut stage, &wish))[0], 1.0);
    wish.choice.graph = files.0.join("graph.ron");
    let mut early = vec![];
    let told = stage.advance(&wish, &mut |told| early.push(told));
    assert_eq!(early.len(), 1, "its last image comes first");
    assert_eq!(pixel(&stage.gpu, &early[0])[0], 0.25);
    assert!(told.frame.is_none(), "nothing had to run: {:?}", told.frame);
    assert_eq!(told.ready.len(), 2);
}

#[test]
fn all_variants_can_be_made_ready() {
    let (files, mut stage) = (Files::new("ready"), stage());
    let wish = FrameRequest { prepare: true, ..files.wish() };
    assert_eq!(settle(&mut stage, &wish).ready.len(), 2);
}

#[test]
fn the_score_against_a_file_and_against_a_graph_is_right() {
    let (files, mut stage) = (Files::new("score"), stage());
    let mut wish = files.wish();
    let exr = files.0.join("reference.exr");
    let reference = Image::filled(8, 6, &[0.5, 0.0, 0.0]).unwrap();
    write_exr(&exr, &[("", &reference)], Precision::Float, &BTreeMap::new()).unwrap();
    wish.choice.compare.against = ComparedTo::Image(exr);
    let told = settle(&mut stage, &wish);
    let Some(ShownScore::Metrics(m)) = told.score.as_deref() else { panic!("{:?}", told.score) };
    // A third of the values is 0.25 where 0.5 is right, the rest is 0.
    assert!((m.bias_percent + 50.0).abs() < 1e-4, "{m:?}");
    assert!((m.rmse_percent - 50.0 * 3f64.sqrt()).abs() < 1e-3, "{m:?}");

    wish.choice.compare.against = ComparedTo::Graph(files.0.join("other.ron"));
    let told = settle(&mut stage, &wish);
    let Some(ShownScore::Metrics(m)) = told.score.as_deref() else { panic!("{:?}", told.score) };
    assert!((m.bias_percent + 75.0).abs() < 1e-4, "{m:?}");

    wish.choice.compare.against = ComparedTo::Image(files.0.join("no.exr"));
    let told = settle(&mut stage, &wish);
    assert!(!told.faults.is_empty() && told.image.is_some());
}

#[test]
fn resources_can_be_looked_into_whatever_they_are() {
    let (files, mut stage) = (Files::new("inspect"), stage());
    let mut wish = files.wish();
    let mut look = |stage: &mut ViewStage, resource: &str, layer| {
        wish.inspect = Some(ResourcePart { resource: resource.into(), mip: 0, layer });
        settle(stage, &wish).inspected.unwrap()
    };
    let seen = look(&mut stage, "ramp", 1);
    let ResourceContent::Plane(image) = &seen.content else { panic!("{seen:?}") };
    assert_eq!(image.data[..4], [10.0, 11.0, 12.0, 13.0]);
    // A layer that is not there is the last one.
    assert_eq!(look(&mut stage, "ramp", 9).layer, 1);
    let seen = look(&mut stage, "list", 0);
    let ResourceContent::Words(words, 12) = &seen.content else { panic!("{seen:?}") };
    assert_eq!(words[..], [0, 7, 0]);
}

#[test]
fn a_pixel_asks_the_pass_that_wrote_it() {
    let (files, mut stage) = (Files::new("probe"), stage());
    let mut wish = files.wish();
    let graph = wish.choice.graph.clone();
    let mut serial = 0;
    let mut ask = |stage: &mut ViewStage, of: ProbedPlace| {
        serial += 1;
        wish.ask = Some(Ask { serial, graph: graph.clone(), of });
        let told = settle(stage, &wish);
        let probed = told.probed.clone().expect("an answer");
        let text = probed.answer.as_ref().map_or_else(|f| render(&f.0), ToString::to_string);
        (told, text.split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let (told, text) = ask(&mut stage, ProbedPlace::Pixel([3, 2]));
    assert!(text.starts_with("`paint`, paint.wgsl, at 3,2,0 inputs position (3.5, 2.5, 0, 1) "), "{text}");
    assert!(text.contains("uniforms red 0.25"), "{text}");
    assert!(text.contains("output result (0.25, 0, 0, 1)"), "{text}");
    assert_eq!(pixel(&stage.gpu, &told), [0.25, 0.0], "the image stays");
    // An edit of the shader is answered anew, by itself.
    let shader = files.0.join("shaders/paint.wgsl");
    fs::write(&shader, PAINT.replace("vec4f(red", "vec4f(3.0 * red")).unwrap();
    stage.changed(&BTreeSet::from([shader]));
    let again = Ask { serial: 1, graph: files.0.join("graph.ron"), of: ProbedPlace::Pixel([3, 2]) };
    let told = settle(&mut stage, &FrameRequest { ask: Some(again), ..files.wish() });
    let answer = told.probed.as_ref().unwrap().answer.as_ref().unwrap().to_string();
    assert!(answer.contains("(0.75, 0, 0, 1)"), "{answer}");
    assert_eq!(pixel(&stage.gpu, &told), [0.75, 0.0]);

    let part = ResourcePart { resource: "ramp".into(), mip: 0, layer: 1 };
    let (_, text) = ask(&mut stage, ProbedPlace::Texel { part, at: [2, 1] });
    assert!(
        text.starts_with("`fill`, fill.wgsl, at 2,1,1") && text.contains("writes ramp[2, 1][1] (12, 12, 12, 12)"),
        "{text}"
    );
    let (told, text) = ask(&mut stage, ProbedPlace::Invocation { step: "pant".into(), at: [0; 3] });
    assert!(text.contains("no pass `pant`") && text.contains("did you mean `paint`?"), "{text}");
    assert!(told.faults.is_empty(), "the image has none");
    let (_, text) = ask(&mut stage, ProbedPlace::Pixel([300, 2]));
    assert!(text.contains("`paint` has no invocation at 300,2,0"), "{text}");
}

#[test]
fn a_lost_device_is_told() {
    let (files, mut stage) = (Files::new("lost"), stage());
    settle(&mut stage, &files.wish());
    stage.gpu.device.destroy();
    // The loss is told when the last work has ended, which nobody waits for.
    let mut lost = |time: f32| {
        let told = stage.advance(&FrameRequest { time, ..files.wish() }, &mut |_| ());
        std::thread::sleep(std::time::Duration::from_millis(20));
        told.lost.then_some(told)
    };
    let told = (1..100).find_map(|i| lost(i as f32)).expect("the loss is told within two seconds");
    assert!(render(&told.faults).contains("the device is lost"), "{}", render(&told.faults));
}
