//! Edits of graph, shaders, parameters, scene and size, one plan after the other: what did not change is not run, and
//! every frame equals one that runs everything.

use crate::{device, support};
use Edit::*;
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::plan::change::Why;
use lightgraph::internals::plan::inputs::{InputKind, KINDS};
use lightgraph::internals::scene::{Shift, TextureArray};
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Value;
use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// One thing that can be another, of three: nothing else changes with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Edit {
    Camera,
    Light,
    Object,
    Material,
    Vertex,
    Texture,
    Gain,
    Turns,
    Wide,
    Reach,
    Clear,
    Filter,
    Order,
    Shader,
    Comment,
    Size,
}

const EDITS: [Edit; 16] = [
    Camera, Light, Object, Material, Vertex, Texture, Gain, Turns, Wide, Reach, Clear, Filter, Order, Shader, Comment,
    Size,
];

/// Of each edit which of the three it is.
type State = [u8; EDITS.len()];

/// Every kind of pass, and a place for each kind of ingredient to matter by itself.
fn graph_text(state: State) -> String {
    let clear = state[Clear as usize];
    let filter = if state[Filter as usize].is_multiple_of(2) { "Nearest" } else { "Linear" };
    let draw = format!(
        "Draw(name: \"draw\", shader: \"draw.wgsl\", depth: \"depth\", clear: {{\"drawn\": (0.{clear}, 0, 0, 1)}}),"
    );
    let spread = "Clear(name: \"empty\", target: \"row\", value: (0, 0, 0, 0)),
        Compute(name: \"spread\", shader: \"spread.wgsl\", over: (\"reach\", 1, 1)),";
    let (first, second) =
        if state[Order as usize].is_multiple_of(2) { (draw.as_str(), spread) } else { (spread, draw.as_str()) };
    format!(
        "Graph(
        params: {{
            \"gain\": Float(default: 0.5, min: 0, max: 9, about: \"of the picture\"),
            \"turns\": Uint(default: 2, min: 1, max: 9, about: \"of the loop\"),
            \"wide\": Uint(default: 8, min: 1, max: 99, about: \"texels\"),
            \"reach\": Uint(default: 4, min: 1, max: 16, about: \"entries\"),
        }},
        resources: {{
            \"soften\": Sampler(filter: {filter}, address: Clamp),
            \"drawn\": Texture(format: Rgba16Float, size: \"screen\"),
            \"depth\": Texture(format: Depth32Float, size: \"screen\"),
            \"ruler\": Texture(format: R32Float, size: (\"wide\", 4)),
            \"extent\": Buffer(stride: 4, count: 1),
            \"row\": Buffer(stride: 4, count: 16),
            \"heap\": Buffer(stride: 4, count: 4),
            \"shadow\": Texture(format: Depth32Float, size: 8, layers: \"light_views\"),
            \"soft\": Texture(format: Rgba32Float, size: \"screen\"),
            \"color\": Texture(format: Rgba32Float, size: \"screen\"),
        }},
        passes: [
            {first}
            {second}
            Draw(name: \"shadows\", shader: \"shadows.wgsl\", each: \"light_views\", frusta: \"light_views\", depth: \"shadow\"),
            Compute(name: \"measure\", shader: \"measure.wgsl\", over: (1, 1, 1)),
            Clear(name: \"zero\", target: \"heap\", value: (0, 0, 0, 0)),
            Loop(name: \"turn\", count: \"turns\", passes: [Compute(name: \"grow\", shader: \"grow.wgsl\", over: (1, 1, 1))]),
            Screen(name: \"blur\", shader: \"blur.wgsl\"),
            Screen(name: \"mix\", shader: \"mix.wgsl\"),
        ],
        outputs: {{\"color\": \"color\"}})"
    )
}

const DRAW: &str = "
struct Node { transform: mat4x4f }
struct Material { base_color: vec4f }
struct Light { position: vec3f }
var<storage, read> nodes: array<Node>;
var<storage, read> materials: array<Material>;
var<storage, read> lights: array<Light>;
var scene_textures: texture_2d_array<f32>;
var<uniform> camera_view_projection: mat4x4f;
struct Varying { @builtin(position) at: vec4f, @location(0) @interpolate(flat) material: u32 }
@vertex fn vertex(@location(0) position: vec3f, @location(3) node: u32, @location(4) material: u32) -> Varying {
    return Varying(camera_view_projection * nodes[node].transform * vec4f(position, 1.0), material);
}
struct Out { @location(0) drawn: vec4f }
@fragment fn fragment(in: Varying) -> Out {
    let texel = textureLoad(scene_textures, vec2u(0), 0, 0);
    return Out(materials[in.material].base_color * texel + vec4f(lights[0].position, 0.0) * 0.125);
}";

/// Each member of it sees a part of the scene.
const SHADOWS: &str = "
struct Node { transform: mat4x4f }
struct LightView { view_projection: mat4x4f }
var<storage, read> nodes: array<Node>;
var<storage, read> light_views: array<LightView>;
@vertex fn vertex(
    @location(0) position: vec3f, @location(3) node: u32, @builtin(instance_index) view: u32
) -> @builtin(position) vec4f {
    return light_views[view].view_projection * nodes[node].transform * vec4f(position, 1.0);
}";

const SPREAD: &str = "
var<storage, read_write> row: array<u32>;
@compute @workgroup_size(1) fn spread(@builtin(global_invocation_id) id: vec3u) { row[id.x] = 1u; }";

const MEASURE: &str = "
var ruler: texture_2d<f32>;
var<storage, read_write> extent: array<u32>;
@compute @workgroup_size(1) fn measure() { extent[0] = textureDimensions(ruler).x; }";

const GROW: &str = "
var<storage, read_write> heap: array<u32>;
@compute @workgroup_size(1) fn grow() { heap[0] = heap[0] * 3u + 1u; }";

const BLUR: &str = "
var drawn: texture_2d<f32>;
var soften: sampler;
struct Out { @location(0) soft: vec4f }
@fragment fn blur(@builtin(position) at: vec4f) -> Out {
    let uv = (at.xy + 0.25) / vec2f(textureDimensions(drawn));
    return Out(textureSampleLevel(drawn, soften, uv, 0.0));
}";

fn mix_text(factor: u8, comment: u8) -> String {
    format!(
        "// {comment}
#import parts::total
var soft: texture_2d<f32>;
var shadow: texture_depth_2d_array;
var<storage, read> row: array<u32>;
var<storage, read> extent: array<u32>;
var<storage, read> heap: array<u32>;
struct Params {{ gain: f32 }}
var<uniform> params: Params;
struct Image {{ @location(0) color: vec4f }}
@fragment fn mixed(@builtin(position) at: vec4f) -> Image {{
    var sum = 0u;
    for (var i = 0u; i < 16u; i++) {{ sum += row[i]; }}
    var depths = 0.0;
    for (var i = 0u; i < textureNumLayers(shadow); i++) {{ depths += textureLoad(shadow, vec2u(at.xy) % 8u, i, 0); }}
    let numbers = depths + total(f32(sum), f32(heap[0]), f32(extent[0])) * {factor}.5;
    return Image(textureLoad(soft, vec2u(at.xy), 0) * params.gain + numbers);
}}"
    )
}

const PARTS: &str = "#define_import_path parts
fn total(a: f32, b: f32, c: f32) -> f32 { return a + 0.0625 * b + 0.125 * c; }
fn unused() -> f32 { return 1.0; }";

fn library(state: State) -> Library {
    let mix = mix_text(state[Shader as usize], state[Comment as usize]);
    // A function that nobody calls is not a change either.
    let parts = PARTS.replace("1.0", &format!("{}.0", state[Comment as usize]));
    let texts = [
        ("draw", DRAW),
        ("shadows", SHADOWS),
        ("spread", SPREAD),
        ("measure", MEASURE),
        ("grow", GROW),
        ("blur", BLUR),
    ];
    let texts = texts.into_iter().chain([("mix", mix.as_str()), ("parts", parts.as_str())]);
    let file = |(name, text): (&str, &str)| {
        let path = format!("{name}.wgsl");
        (path.clone(), Source::new(path, text))
    };
    Library { files: texts.map(file).collect(), ..Library::default() }
}

fn project(state: State) -> Project {
    let source = Source::new("edits.ron", graph_text(state));
    let read = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("edits.ron"), &read).unwrap_or_else(|f| panic!("{f}"));
    Project { graph, texts: library(state) }
}

fn scene_of(base: &Scene, state: State) -> Scene {
    let mut scene = base.clone();
    let texel = vec![255 - state[Texture as usize], 255, 255, 255];
    scene.textures = Some(TextureArray { width: 1, height: 1, layers: 1, mips: vec![texel] });
    scene.materials.iter_mut().for_each(|m| m.base_color.y = 0.25 * f32::from(state[Material as usize]));
    // Up to a metre towards the camera's side, whatever the corner was.
    Arc::make_mut(&mut scene.geometry).vertices[0].position[1] += 0.25 * f32::from(state[Vertex as usize]);
    scene
}

/// What stands after some edits, played on one device.
struct Player<'a> {
    gpu: &'a Gpu,
    base: Scene,
    without: Option<InputKind>,
    state: State,
    session: Option<Session>,
    frame: u32,
}

impl<'a> Player<'a> {
    fn new(gpu: &'a Gpu, without: Option<InputKind>) -> Player<'a> {
        let scene = Scene::load(&support::repository("scenes/cornell_point.gltf")).unwrap_or_else(|f| panic!("{f}"));
        Player { gpu, base: scene.scene, without, state: State::default(), session: None, frame: 0 }
    }

    /// A frame of a state; compared with one in full.
    fn frame(&mut self, state: State) -> Checked<()> {
        let live = [Camera as usize, Light as usize, Object as usize];
        let replan = (0..state.len()).any(|i| state[i] != self.state[i] && !live.contains(&i));
        if replan || self.session.is_none() {
            let project = project(state);
            let number = |e: Edit| u32::from(state[e as usize]);
            let params = [
                ("gain", Value::Float(0.5 + number(Gain) as f32)),
                ("turns", Value::Uint(1 + number(Turns))),
                ("wide", Value::Uint(8 + number(Wide))),
                ("reach", Value::Uint(4 + number(Reach))),
            ];
            let settings = Settings {
                params: params.map(|(n, v)| (n.to_string(), v)).into(),
                size: [16 + number(Size), 12],
                skip: true,
                verify: true,
                without: self.without,
                ..Settings::default()
            };
            let scene = scene_of(&self.base, state);
            self.session = Some(Session::after(self.gpu, &project, scene, settings, self.session.as_ref())?);
        }
        self.state = state;
        let Some(session) = &mut self.session else { return Ok(()) };
        let by = |e: Edit| 0.125 * f32::from(state[e as usize]);
        session.shift = Shift {
            cameras: glam::Vec3::X * by(Camera),
            lights: glam::Vec3::Y * by(Light),
            nodes: vec![(0, glam::Vec3::Z * by(Object))],
            ..Shift::default()
        };
        self.frame += 1;
        session.frame(self.gpu, self.frame - 1, 0.0).map(|_| ())
    }

    fn why(&self) -> Vec<(&str, &Why)> {
        let session = self.session.iter();
        session.flat_map(|s| s.plan.steps.iter().map(|s| s.name.as_str()).zip(s.why())).collect()
    }

    fn ran(&self) -> BTreeSet<&str> {
        self.why().into_iter().filter(|(_, w)| w.runs()).map(|(n, _)| n).collect()
    }
}

fn with(edit: Edit, choice: u8) -> State {
    let mut state = State::default();
    state[edit as usize] = choice;
    state
}

/// What runs after an edit, and the reason of the first of them.
fn expected(edit: Edit) -> (&'static [&'static str], &'static str) {
    match edit {
        Camera => (&["draw", "blur", "mix"], "changed: camera_view_projection"),
        Light => (&["draw", "shadows", "shadows.cull", "blur", "mix"], "changed: table lights"),
        Object => (&["draw", "shadows", "shadows.cull", "blur", "mix"], "changed: table nodes"),
        Material => (&["draw", "blur", "mix"], "changed: table materials"),
        Vertex => (&["draw", "shadows", "shadows.cull", "blur", "mix"], "changed: the scene's triangles"),
        Texture => (&["draw", "blur", "mix"], "changed: the scene's textures"),
        Gain => (&["mix"], "changed: gain"),
        Turns => (&["zero", "grow", "mix"], "its result was overwritten in shared memory"),
        Wide => (&["measure", "mix"], "changed: size of ruler"),
        Reach => (&["empty", "spread", "mix"], "its result was overwritten in shared memory"),
        Clear => (&["draw", "blur", "mix"], "changed: how it draws"),
        Filter => (&["blur", "mix"], "changed: sampler soften"),
        Order | Comment => (&[], ""),
        Shader => (&["mix"], "changed: shader mix.wgsl"),
        Size => (&["draw", "blur", "mix"], "changed: camera_view_projection, size of depth, size of drawn"),
    }
}

#[test]
fn an_edit_runs_what_reads_it_and_nothing_else() {
    let gpu = &device::gpu();
    for edit in EDITS {
        let mut player = Player::new(gpu, None);
        let mut frame = |state: State| {
            player.frame(state).unwrap_or_else(|f| panic!("{edit:?}: {f}"));
            let ran: BTreeSet<String> = player.ran().into_iter().map(String::from).collect();
            (ran, player.why().into_iter().find(|(_, w)| w.runs()).map_or(String::new(), |(_, w)| w.to_string()))
        };
        frame(State::default());
        assert_eq!(frame(State::default()), (BTreeSet::new(), String::new()), "nothing changed");
        let (passes, why) = expected(edit);
        let passes: BTreeSet<String> = passes.iter().map(ToString::to_string).collect();
        assert_eq!(frame(with(edit, 1)), (passes.clone(), why.to_string()), "{edit:?}");
        assert_eq!(frame(State::default()).0, passes, "{edit:?} undone");
    }
}

#[test]
fn what_did_not_run_says_since_when() {
    let gpu = &device::gpu();
    let mut player = Player::new(gpu, None);
    for state in [State::default(), with(Gain, 1), with(Camera, 1)] {
        player.frame(state).unwrap_or_else(|f| panic!("{f}"));
    }
    let why = player.why().into_iter().find(|(n, _)| *n == "measure").map(|(_, w)| w.to_string());
    assert_eq!(why.as_deref(), Some("unchanged since frame 0"));
}

/// The edit that only this kind of ingredient tells of.
fn telling(kind: InputKind) -> Edit {
    match kind {
        InputKind::Shader => Shader,
        InputKind::Value => Gain,
        InputKind::Table => Material,
        InputKind::Geometry => Vertex,
        InputKind::Textures => Texture,
        InputKind::Resource => Material,
        InputKind::Size => Wide,
        InputKind::Target => Clear,
        InputKind::Extent => Reach,
        InputKind::Loop => Turns,
        InputKind::Sampler => Filter,
    }
}

#[test]
fn the_proof_catches_a_key_without_any_one_of_its_ingredients() {
    let gpu = &device::gpu();
    for kind in KINDS {
        let mut player = Player::new(gpu, Some(kind));
        player.frame(State::default()).unwrap_or_else(|f| panic!("{kind:?}: {f}"));
        let faults = player.frame(with(telling(kind), 1)).expect_err(&format!("a key without {kind:?}"));
        let text = faults.to_string();
        assert!(text.contains("differs from a full run"), "{kind:?}: {text}");
    }
}

#[test]
fn random_edits_in_any_order_equal_full_runs() {
    let gpu = &device::gpu();
    let edit = (0..EDITS.len(), 0..3u8);
    let sequences = proptest::collection::vec(edit, 1..12);
    // The same sequences every time; few, as each frame runs twice on what may be a software driver.
    let config = Config { cases: 24, failure_persistence: None, max_shrink_iters: 200, ..Config::default() };
    let random = proptest::test_runner::TestRng::deterministic_rng(config.rng_algorithm);
    let played = TestRunner::new_with_rng(config, random).run(&sequences, |sequence| {
        let mut player = Player::new(gpu, None);
        let mut state = State::default();
        for (edit, choice) in sequence {
            state[edit] = choice;
            player.frame(state).map_err(|f| TestCaseError::fail(f.to_string()))?;
        }
        Ok(())
    });
    played.unwrap_or_else(|e| panic!("{e}"));
}
