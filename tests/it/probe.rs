//! What a probe says of an invocation is what the invocation computed.

use crate::device;
use crate::support::{Random, Scratch, command, files, plan_without_device};
use lightgraph::internals::plan::build::Planned;
use lightgraph::internals::plan::{Action, ResourceId};
use lightgraph::internals::session::Probing;
use lightgraph::internals::shader::probe::{Invocation, Probe, Role, instrument};
use lightgraph::internals::value::Values;
use lightgraph::{Checked, Gpu, Image, Project, Scene, Session, Settings};
use std::fs;
use std::path::Path;

const SIZE: [u32; 2] = [48, 32];

const GRAPH: &str = r#"Graph(
    about: "Waves and their sum",
    params: {"gain": Float(default: 1.7)},
    resources: {
        "waves": Texture(format: Rgba32Float, size: "screen"),
        "depth": Texture(format: Depth32Float, size: "screen"),
        "color": Texture(format: Rgba32Float, size: "screen"),
    },
    passes: [
        Compute(name: "wave", shader: "wave.wgsl", over: "waves"),
        Clear(name: "blank", target: "depth", value: (1, 1, 1, 1)),
        Loop(name: "again", count: 3, passes: [Screen(name: "show", shader: "show.wgsl", color: "color")]),
    ],
    outputs: {"color": "color", "waves": "waves", "depth": "depth"},
)"#;

const WAVE: &str = "var waves: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3u) {
    let at = vec2f(id.xy) * 0.37;
    let wave = vec4f(sin(at.x), cos(at.y), at.x / (1.0 + at.y), 1.0);
    textureStore(waves, id.xy, wave);
}";

const SHOW: &str = "struct Level { weight: f32, near: bool, start: vec2i }

var waves: texture_2d<f32>;
var<uniform> gain: f32;

fn squared(x: f32) -> f32 {
    let square = x * x;
    return square;
}

fn level(i: u32) -> Level {
    let found = Level(f32(i) * 0.5, i < 2u, vec2i(i32(i), -3));
    return found;
}

@fragment fn show(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let texel = vec2u(place.xy);
    var sum = 0.0;
    for (var i = 0u; i < 6u; i++) {
        let l = level(i);
        sum += squared(textureLoad(waves, texel, 0)[i % 3u]) * l.weight;
    }
    if texel.x == 5u {
        discard;
    }
    let total = sum * gain;
    return vec4f(total, exp(-total), sqrt(total), 1.0);
}";

struct Asked {
    gpu: std::sync::MutexGuard<'static, Gpu>,
    _scratch: Scratch,
    graph: std::path::PathBuf,
}

impl Asked {
    fn new(name: &str) -> Asked {
        let scratch = Scratch::new(name);
        fs::create_dir_all(scratch.path().join("shaders")).unwrap();
        for (file, text) in [("graph.ron", GRAPH), ("shaders/wave.wgsl", WAVE), ("shaders/show.wgsl", SHOW)] {
            fs::write(scratch.path().join(file), text).unwrap();
        }
        let graph = scratch.path().join("graph.ron");
        Asked { gpu: device::gpu(), _scratch: scratch, graph }
    }

    fn session(&self, pass: Option<&str>, values: &[&str]) -> Checked<Session> {
        session(&self.gpu, &self.graph, pass, values)
    }

    fn fault(&self, pass: &str, values: &[&str]) -> String {
        self.session(Some(pass), values).err().map_or(String::new(), |f| f.to_string())
    }
}

fn session(gpu: &Gpu, graph: &Path, pass: Option<&str>, values: &[&str]) -> Checked<Session> {
    let project = Project::open(graph, &[])?;
    let probe =
        pass.map(|pass| Probing { pass: pass.into(), values: values.iter().map(|v| (*v).to_string()).collect() });
    let settings = Settings { size: SIZE, probe, ..Settings::default() };
    Session::new(gpu, &project, Scene::stand_in()?.scene, settings)
}

/// The images that the graph makes without a probe.
fn expected(asked: &Asked) -> (Image, Image) {
    let mut plain = asked.session(None, &[]).unwrap_or_else(|f| panic!("{f}"));
    plain.frame(&asked.gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let image = |name: &str| plain.image(&asked.gpu, name).unwrap_or_else(|f| panic!("{f}"));
    (image("color"), image("waves"))
}

fn ask(asked: &Asked, session: &mut Session, at: [u32; 2]) -> (u32, Vec<Invocation>) {
    session.probe(&asked.gpu, [at[0], at[1], 0]).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&asked.gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    session.probed(&asked.gpu).unwrap_or_else(|f| panic!("{f}"))
}

/// The last value of a name, as floats.
fn floats(probe: &Probe, invocation: &Invocation, role: Role, name: &str) -> Option<Vec<f32>> {
    let reading = invocation.readings.iter().rev().find(|r| {
        let site = &probe.sites[r.site];
        site.role == role && site.name == name
    })?;
    let words = probe.sites[reading.site].value(reading.words.last()?);
    Some(words.iter().map(|w| f32::from_bits(*w)).collect())
}

/// Whether two numbers are the same or neighbours.
fn near(a: f32, b: f32) -> bool {
    let order = |x: f32| if x < 0.0 { -i64::from(x.to_bits() & 0x7fff_ffff) } else { i64::from(x.to_bits()) };
    (order(a) - order(b)).abs() <= 1
}

fn close(said: &[f32], read: &[f32], what: &str) {
    assert_eq!(said.len(), read.len(), "{what}");
    assert!(said.iter().zip(read).all(|(a, b)| near(*a, *b)), "{what}: the probe says {said:?}, the image {read:?}");
}

#[test]
fn fifty_pixels_of_a_screen_pass_equal_a_readback() {
    let asked = Asked::new("probe-screen");
    let (plain, waves) = expected(&asked);
    let mut session = asked.session(Some("show"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let mut random = Random(37);
    for _ in 0..50 {
        let at = [random.below(SIZE[0] as usize) as u32, random.below(SIZE[1] as usize) as u32];
        let (count, invocations) = ask(&asked, &mut session, at);
        assert_eq!((count, invocations.len()), (3, 3), "once for each iteration");
        let (_, probe) = session.probe_sites().unwrap_or_else(|f| panic!("{f}"));
        let last = &invocations[2];
        let said = |role: Role, name: &str| floats(probe, last, role, name);
        let color = session.image(&asked.gpu, "color").unwrap_or_else(|f| panic!("{f}"));
        let pixel = color.pixel(0, at[0], at[1]).unwrap();
        // A driver may fuse other products and sums in the copy: what both make of them differs by rounding.
        let without = plain.pixel(0, at[0], at[1]).unwrap();
        assert!(pixel.iter().zip(without).all(|(a, b)| (a - b).abs() <= 1e-5 * b.abs()), "{pixel:?} {without:?}");
        close(&said(Role::Read, "waves[]").unwrap(), waves.pixel(0, at[0], at[1]).unwrap(), "what is read");
        close(&said(Role::Uniform, "gain").unwrap(), &[1.7], "the uniform");
        let place = said(Role::Argument, "place").unwrap();
        assert_eq!(place[..2], [at[0] as f32 + 0.5, at[1] as f32 + 0.5]);
        match said(Role::Return, "result") {
            Some(result) => {
                close(&result, pixel, "the output");
                close(&said(Role::Let, "total").unwrap(), &pixel[..1], "a let");
            }
            None => assert_eq!(at[0], 5, "the fragment was discarded"),
        }
        // A loop keeps the last few values, and how often there was one.
        let square = last.readings.iter().find(|r| probe.sites[r.site].name == "square").unwrap();
        assert_eq!((square.count, square.words.len()), (6, 4));
    }
}

#[test]
fn fifty_invocations_of_a_compute_pass_equal_a_readback() {
    let asked = Asked::new("probe-compute");
    let (_, waves) = expected(&asked);
    let mut session = asked.session(Some("wave"), &["wave"]).unwrap_or_else(|f| panic!("{f}"));
    let mut random = Random(73);
    for _ in 0..50 {
        let at = [random.below(SIZE[0] as usize) as u32, random.below(SIZE[1] as usize) as u32];
        let (count, invocations) = ask(&asked, &mut session, at);
        assert_eq!(count, 1);
        let (_, probe) = session.probe_sites().unwrap_or_else(|f| panic!("{f}"));
        let said = |role: Role, name: &str| floats(probe, &invocations[0], role, name);
        let pixel = waves.pixel(0, at[0], at[1]).unwrap();
        close(&said(Role::Write, "waves[]").unwrap(), pixel, "what is written");
        close(&said(Role::Let, "wave").unwrap(), pixel, "a let");
        assert_eq!(said(Role::Let, "at"), None, "nobody asked for it");
    }
}

#[test]
fn what_can_not_be_asked_is_told_with_a_remedy() {
    let asked = Asked::new("probe-faults");
    for (pass, values, words) in [
        ("shw", &[][..], &["the plan has no pass `shw`", "did you mean `show`?"][..]),
        ("blank", &[], &["`blank` runs no shader", "Screen, Draw or Compute"]),
        ("show", &["totl"], &["`show` computes no `totl`", "did you mean `total`?"]),
    ] {
        let fault = asked.fault(pass, values);
        assert!(words.iter().all(|w| fault.contains(w)), "{fault}");
    }
    let session = asked.session(Some("wave"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let outside = session.probe(&asked.gpu, [48, 0, 0]).unwrap_err().to_string();
    assert!(outside.contains("no invocation at 48,0,0") && outside.contains("48 × 32 × 1"), "{outside}");
    let plain = asked.session(None, &[]).unwrap_or_else(|f| panic!("{f}"));
    assert!(plain.probed(&asked.gpu).unwrap_err().to_string().contains("probes no pass"));
    // A device all of whose storage buffers the shader has.
    let limits = wgpu::Limits { max_storage_buffers_per_shader_stage: 0, ..wgpu::Limits::default() };
    let noop = Gpu::noop(limits).unwrap_or_else(|f| panic!("{f}"));
    let full = session_fault(&noop, &asked.graph);
    assert!(full.contains("0 storage buffers, all that this device gives a stage"), "{full}");
}

/// Copies, levels, passes for other frames and dispatches over blocks stand between a texel and the shader that wrote it.
#[test]
fn a_texel_leads_to_the_invocation_that_wrote_it() {
    const PATHS: &str = r#"Graph(
        about: "Ways to a texel",
        resources: {
            "first": Texture(format: Rgba32Float, size: "screen", history: true),
            "copied": Texture(format: Rgba32Float, size: "screen"),
            "chain": Texture(format: Rgba32Float, size: "screen", mips: 2),
            "blocks": Texture(format: Rgba32Float, size: "screen"),
            "cube": Texture(format: Rgba32Float, size: (16, 16), layers: 3),
        },
        passes: [
            Screen(name: "paint", shader: "one.wgsl", color: "first"),
            Screen(name: "once", when: "first_frame", shader: "one.wgsl", color: "first", load: ["first"]),
            Copy(name: "keep", from: "first", to: "copied"),
            Screen(name: "fine", shader: "level.wgsl", bind: {"level": (of: "chain", mip: 0)}),
            Screen(name: "coarse", shader: "level.wgsl", bind: {"level": (of: "chain", mip: 1)}),
            Compute(name: "in_blocks", shader: "blocks.wgsl", over: (6, 4, 1)),
            Compute(name: "layers", shader: "layers.wgsl", over: "cube"),
        ],
        outputs: {"copied": "copied", "chain": "chain", "blocks": "blocks", "cube": "cube"},
    )"#;
    const ONE: &str = "@fragment fn main() -> @location(0) vec4f { return vec4f(1.0); }";
    const LEVEL: &str = "struct To { @location(0) level: vec4f }
@fragment fn main() -> To { return To(vec4f(1.0)); }";
    const BLOCKS: &str = "var blocks: texture_storage_2d<rgba32float, write>;
@compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u) {
    for (var i = 0u; i < 64u; i++) {
        textureStore(blocks, id.xy * 8u + vec2u(i % 8u, i / 8u), vec4f(2.0));
    }
}";
    const LAYERS: &str = "var cube: texture_storage_2d_array<rgba32float, write>;
@compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3u) {
    textureStore(cube, id.xy, id.z, vec4f(vec3f(id), 1.0));
}";
    let asked = Asked::new("probe-writer");
    let at = |file: &str| asked._scratch.path().join(file);
    for (name, text) in [("one", ONE), ("level", LEVEL), ("blocks", BLOCKS), ("layers", LAYERS)] {
        fs::write(at(&format!("shaders/{name}.wgsl")), text).unwrap();
    }
    fs::write(at("graph.ron"), PATHS).unwrap();
    let mut session = asked.session(None, &[]).unwrap_or_else(|f| panic!("{f}"));
    let mut found = |frame: u32, resource: &str, part: (u32, u32), texel: [u32; 2]| {
        session.frame(&asked.gpu, frame, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let id = session.plan.resources.iter().position(|r| r.name == resource).expect("it is in the plan");
        let writer = session.writer(ResourceId(id), part, texel);
        writer.map(|(step, at)| (session.plan.steps[step.0].name.clone(), at)).map_err(|f| f.to_string())
    };
    let is = |step: &str, at: [u32; 3]| Ok((step.to_string(), at));
    assert_eq!(found(0, "copied", (0, 0), [7, 3]), is("once", [7, 3, 0]));
    assert_eq!(found(1, "copied", (0, 0), [7, 3]), is("paint", [7, 3, 0]));
    assert_eq!(found(1, "chain", (0, 0), [7, 3]), is("fine", [7, 3, 0]));
    assert_eq!(found(1, "chain", (1, 0), [7, 3]), is("coarse", [7, 3, 0]));
    assert_eq!(found(1, "cube", (0, 2), [7, 3]), is("layers", [7, 3, 2]));
    let fault = found(1, "blocks", (0, 0), [7, 3]).unwrap_err();
    assert!(fault.contains("`in_blocks` wrote `blocks`, but not by an invocation for each texel"), "{fault}");
    fs::write(at("graph.ron"), GRAPH).unwrap();
    let mut session = asked.session(None, &[]).unwrap_or_else(|f| panic!("{f}"));
    session.frame(&asked.gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let depth = session.plan.resources.iter().position(|r| r.name == "depth").expect("it is in the plan");
    let fault = session.writer(ResourceId(depth), (0, 0), [1, 1]).unwrap_err().to_string();
    assert!(fault.contains("`blank` cleared `depth`"), "{fault}");
}

fn session_fault(gpu: &Gpu, graph: &Path) -> String {
    session(gpu, graph, Some("wave"), &[]).err().map_or(String::new(), |f| f.to_string())
}

#[test]
fn the_command_shows_inputs_values_and_outputs() {
    let asked = Asked::new("probe-command");
    let run = |args: &[&str]| {
        let output = command().arg("probe").arg(&asked.graph).args(["--size", "48x32"]).args(args).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        (output.status.code(), text)
    };
    let (code, text) = run(&["--pass", "show", "--at", "7,3"]);
    assert_eq!(code, Some(0), "{text}");
    for words in [
        "`show`, show.wgsl, at 7,3,0",
        "invocation 3 of 3",
        "place  (7.5, 3.5, 0, 1)",
        "gain  1.7",
        "waves[7, 3]",
        "values of `squared`",
        "found  {weight: 2.5, near: false, start: (5, -3)}   the last of 6",
        "values of `show`",
        "texel  (7, 3)",
        "output\n  result  (",
    ] {
        let spaced = words.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.split_whitespace().collect::<Vec<_>>().join(" ").contains(&spaced), "no `{words}` in\n{text}");
    }
    let (_, text) = run(&["--pass", "show", "--at", "5,3"]);
    assert!(text.contains("none: the fragment was discarded"), "{text}");
    let (code, text) = run(&["--pass", "show", "--at", "7"]);
    assert!(code == Some(2) && text.contains("X,Y or X,Y,Z"), "{text}");
    let (code, text) = run(&["--pass", "show", "--at", "7,300"]);
    assert!(code == Some(1) && text.contains("has no invocation at 7,300,0"), "{text}");
}

/// The copies are shaders that a device takes: every stage of every pass that ships.
#[test]
fn every_shipped_pass_can_be_copied() {
    use naga::valid::{Capabilities, ValidationFlags, Validator};
    let mut sites = 0;
    for folder in ["graphs/gi", "graphs/post", "graphs/play", "graphs/lists"] {
        for path in files(folder, &["ron"]) {
            let project = Project::open(&path, &[]).unwrap_or_else(|f| panic!("{f}"));
            let planned = plan_without_device(&project, &Values::new(), None, true);
            let Planned { plan, .. } = planned.unwrap_or_else(|f| panic!("{f}"));
            let mut seen = vec![];
            for step in &plan.steps {
                let entry = match &step.action {
                    Action::Draw(draw) => draw.fragment.clone(),
                    Action::Compute { entry, .. } => Some(entry.clone()),
                    Action::Copy { .. } | Action::Clear { .. } => None,
                };
                let (Some(shader), Some(entry)) = (step.action.shader(), entry) else { continue };
                if seen.contains(&(shader, entry.clone())) {
                    continue;
                }
                let probe = instrument(&plan.shaders[shader], &entry, &[]).unwrap_or_else(|f| panic!("{f}"));
                let able = Capabilities::default()
                    | Capabilities::STORAGE_TEXTURE_16BIT_NORM_FORMATS
                    | Capabilities::MULTIVIEW;
                let mut validator = Validator::new(ValidationFlags::all(), able);
                if let Err(e) = validator.validate(&probe.shader.module) {
                    panic!("{}: {}: {e:?}", path.display(), step.name);
                }
                sites += probe.sites.len();
                seen.push((shader, entry));
            }
        }
    }
    assert!(sites > 1000, "{sites}");
}
