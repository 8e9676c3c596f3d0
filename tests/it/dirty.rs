//! What moves is drawn again only in the views that show it, before or after, and what follows from them alone is made
//! again; every frame is compared with a full run.

use crate::{device, support};
use glam::Vec3;
use lightgraph::internals::plan::change::Why;
use lightgraph::internals::scene::Shift;
use lightgraph::{Checked, FrameReport, Gpu, Project, Scene, Session, Settings};

fn session(gpu: &Gpu, graph: &str, scene: &str, set: &[&str]) -> Session {
    let project = Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let outputs = Some(vec!["color".to_string()]);
    open(gpu, &project, scene, set, Settings { outputs, ..Settings::default() })
}

fn open(gpu: &Gpu, project: &Project, scene: &str, set: &[&str], settings: Settings) -> Session {
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let loaded = Scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { params, size: [16, 12], skip: true, verify: true, ..settings };
    Session::new(gpu, project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// A graph of its own in the hall, with its shaders and those that ship.
fn written(gpu: &Gpu, name: &str, graph: &str, shaders: &[(&str, &str)], set: &[&str]) -> Session {
    let scratch = support::Scratch::new(name);
    std::fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    let file = scratch.path().join(name).with_extension("ron");
    std::fs::write(&file, graph).unwrap();
    for (name, text) in shaders {
        std::fs::write(scratch.path().join("shaders").join(name).with_extension("wgsl"), text).unwrap();
    }
    let project = Project::open(&file, &[support::repository("shaders")]).unwrap_or_else(|f| panic!("{f}"));
    open(gpu, &project, "hall.ron", set, Settings::default())
}

/// How much of a pass ran in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Ran {
    No,
    /// For so many of its instances.
    Part(u32),
    Full,
}

impl Ran {
    fn part(self) -> u32 {
        if let Ran::Part(some) = self { some } else { panic!("it ran otherwise than in part: {self:?}") }
    }
}

fn ran(session: &Session, report: &FrameReport, pass: &str) -> Ran {
    let step = session.plan.steps.iter().position(|s| s.name == pass).unwrap_or_else(|| panic!("no step `{pass}`"));
    let time = report.steps.iter().find(|time| time.step == step);
    let ran = time.map_or(Ran::No, |time| time.instances.map_or(Ran::Full, Ran::Part));
    let why = &session.why()[step];
    assert_eq!(matches!(why, Why::ChangedInPart(_)), matches!(ran, Ran::Part(_)), "`{pass}`: {why}, {ran:?}");
    assert_eq!(why.runs(), ran != Ran::No, "`{pass}`: {why}, {ran:?}");
    ran
}

/// The node of this name.
fn node(session: &Session, name: &str) -> usize {
    let mut nodes = session.scene.nodes.iter();
    nodes.position(|n| n.name == name).unwrap_or_else(|| panic!("no node `{name}`"))
}

fn tried(gpu: &Gpu, session: &mut Session, moved: &[(usize, Vec3)]) -> Checked<FrameReport> {
    session.shift.nodes = moved.to_vec();
    session.frame(gpu, 0, 0.0)
}

fn frame(gpu: &Gpu, session: &mut Session, moved: &[(usize, Vec3)]) -> FrameReport {
    tried(gpu, session, moved).unwrap_or_else(|f| panic!("{moved:?}: {f}"))
}

#[test]
fn an_object_is_captured_again_only_by_the_faces_that_see_it() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "hall.ron", &["grid=3", "face=8", "bounces=1"]);
    let ball = node(&s, "ball");
    frame(gpu, &mut s, &[]);
    let there = [(ball, Vec3::new(0.05, 0.1, 0.0))];
    let r = frame(gpu, &mut s, &there);
    let some = ran(&s, &r, "capture.capture").part();
    // Every probe has a face that looks its way.
    assert!(some > 0 && some < 27 * 2, "{some} of {} faces show the ball", 27 * 6);
    // Nothing more moves: nothing more is drawn, nor marked.
    let r = frame(gpu, &mut s, &there);
    assert_eq!([ran(&s, &r, "capture.capture"), ran(&s, &r, "capture.moved_faces")], [Ran::No; 2]);
    let r = frame(gpu, &mut s, &[]);
    assert_eq!(ran(&s, &r, "capture.capture"), Ran::Part(some), "back where it was, seen by the same faces");
}

/// Rays find the same faces as drawing does but for those that a wall hides, and probes are lit again that see what
/// moved.
#[test]
fn rays_are_traced_again_only_for_the_faces_that_show_what_moved() {
    let gpu = &device::gpu();
    let set = ["grid=2", "face=8", "bounces=2", "shadow_size=256"];
    let mut s = session(gpu, "fast_grid.ron", "hall.ron", &set);
    let mut drawn = session(gpu, "fast_grid.ron", "hall.ron", &[&set[..], &["rays_above=1000000"]].concat());
    let (corbel, ball) = (node(&s, "corbel"), node(&s, "ball"));
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut drawn, &[]);
    for i in 1..4 {
        let moved = [(corbel, Vec3::new(0.03 * i as f32, 0.0, 0.0))];
        let r = frame(gpu, &mut s, &moved);
        let some = ran(&s, &r, "capture.capture_rays").part();
        assert!(some > 0 && some < 24, "{some} of 48 faces show the corbel");
        let lit = ran(&s, &r, "first.first_bounce").part();
        assert!(lit > 0 && lit <= some, "{lit} of 8 probes for {some} faces");
        let r = frame(gpu, &mut drawn, &moved);
        let as_drawn = ran(&drawn, &r, "capture.capture").part();
        assert!(some <= as_drawn && as_drawn < 24, "{some} faces by rays, {as_drawn} drawn");
    }
    // Far through the hall, into the ball, out of the scene's box, and back.
    for by in [Vec3::new(0.0, -1.0, 2.0), Vec3::splat(40.0), Vec3::ZERO] {
        frame(gpu, &mut s, &[(corbel, by), (ball, 0.5 * by)]);
    }
}

/// What moves in the dark leaves the light that probes were lit by as it was; only probes that see it have anything new
/// to send.
#[test]
fn an_object_in_the_dark_lights_again_only_the_probes_that_see_it() {
    let gpu = &device::gpu();
    let set = ["grid=4", "face=8", "bounces=2", "shadow_size=256"];
    let mut s = session(gpu, "fast_grid.ron", "hall.ron", &set);
    let (corbel, ball) = (node(&s, "corbel"), node(&s, "ball"));
    frame(gpu, &mut s, &[]);
    for i in 1..4 {
        let r = frame(gpu, &mut s, &[(corbel, Vec3::new(0.03 * i as f32, 0.0, 0.0))]);
        assert_eq!(ran(&s, &r, "shadow.shadow_maps"), Ran::Part(0), "the light does not see the corbel");
        let (first, second) = (ran(&s, &r, "first.first_bounce").part(), ran(&s, &r, "second.gather").part());
        assert!(first > 0 && second >= first && second < 64, "{first} and {second} of 64 probes");
    }
    // Back where it was, all is as it was.
    let end = s.image(gpu, "color").unwrap_or_else(|f| panic!("{f}"));
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut s, &[(corbel, Vec3::new(0.09, 0.0, 0.0))]);
    assert!(s.image(gpu, "color").unwrap_or_else(|f| panic!("{f}")) == end);
    // What stands in the light changes the light of all, and every probe gathers it.
    let r = frame(gpu, &mut s, &[(ball, Vec3::new(0.1, 0.2, 0.0))]);
    assert_eq!(ran(&s, &r, "shadow.shadow_maps"), Ran::Part(1));
    assert_eq!(ran(&s, &r, "second.gather"), Ran::Part(64));
}

/// Where the first bounce of few probes comes out otherwise, only those need the second that take light from them or
/// see something else.
#[test]
fn light_that_changes_at_few_probes_is_gathered_again_by_those_that_take_it() {
    let gpu = &device::gpu();
    let set = ["grid=8", "face=8", "bounces=2", "shadow_size=256"];
    for graph in ["fast_grid.ron", "fast_grid_visible.ron"] {
        let mut s = session(gpu, graph, "hall.ron", &set);
        let corbel = node(&s, "corbel");
        frame(gpu, &mut s, &[]);
        let mut few = 0;
        for i in 1..6 {
            // So far that it covers other texels of what probes see, however a device rounds.
            let r = frame(gpu, &mut s, &[(corbel, Vec3::new(0.1, -0.06, 0.08) * i as f32)]);
            let first = ran(&s, &r, "first.first_bounce").part();
            if graph == "fast_grid.ron" {
                let second = ran(&s, &r, "second.gather").part();
                assert!(second >= first && second < 512, "{first} and {second} of 512 probes");
                // Light that changed at some of them is what the others take.
                few += u32::from(second > first);
            }
        }
        assert!(graph != "fast_grid.ron" || few > 0, "the first bounce came out the same everywhere, always");
    }
}

/// An object in the light changes squares of the shadow map: probes that look elsewhere, and do not see it, are not lit
/// again.
#[test]
fn an_object_in_the_light_lights_again_only_the_probes_that_its_shadow_may_reach() {
    let gpu = &device::gpu();
    let set = ["grid=4", "face=8", "bounces=2", "shadow_size=256"];
    for (graph, scene, name) in
        [("fast_grid.ron", "hall.ron", "urn"), ("fast_grid.ron", "two_rooms.glb", "lit_room_block")]
    {
        let mut s = session(gpu, graph, scene, &set);
        let moved = node(&s, name);
        frame(gpu, &mut s, &[]);
        let mut lit = vec![];
        for i in 1..5 {
            let r = frame(gpu, &mut s, &[(moved, Vec3::new(0.01 * i as f32, 0.0, 0.0))]);
            lit.push(ran(&s, &r, "first.first_bounce").part());
        }
        assert!(lit.iter().all(|some| *some > 0 && *some <= 64), "{scene}: {lit:?} of 64 probes");
        // The light itself lights all of them.
        s.shift.lights = Vec3::new(0.0, -0.05, 0.0);
        let r = s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        assert_eq!(ran(&s, &r, "first.first_bounce"), Ran::Full);
        // Both at once.
        s.shift.lights = Vec3::new(0.0, -0.06, 0.0);
        let r = frame(gpu, &mut s, &[(moved, Vec3::ZERO)]);
        assert_eq!(ran(&s, &r, "first.first_bounce"), Ran::Full);
    }
}

/// Bits that leave out where something was, where a shadow falls or whom light reaches are found out.
#[test]
fn the_proof_catches_bits_that_say_too_little() {
    let gpu = &device::gpu();
    let none = "var<storage, read_write> bits: array<u32>;
        @compute @workgroup_size(1) fn main() { bits[0] &= 1u; }";
    let cases = [
        ("shadow.moved_lights", "light_dirty", "lights > 0", "urn"),
        ("capture.moved_faces", "face_dirty", "probes > 0", "corbel"),
        ("first.dirty_first", "first_dirty", "probes > 0", "urn"),
        ("second.dirty_second", "second_dirty", "second_apart", "urn"),
    ];
    for (pass, bits, when, moved) in cases {
        let graph = format!(
            r#"Variant(
                base: "lightgraph:graphs/gi/fast_grid.ron",
                passes: {{"{pass}": Compute(
                    shader: "none.wgsl", when: "{when}", bind: {{"bits": "{bits}"}}, over: (1, 1, 1),
                )}},
            )"#
        );
        let set = ["grid=4", "face=8", "bounces=2", "shadow_size=256"];
        let mut s = written(gpu, "too_little", &graph, &[("none", none)], &set);
        let moved = node(&s, moved);
        frame(gpu, &mut s, &[]);
        let mut by = [0.05, 0.5, 1.0, 2.0].into_iter();
        let fault = by.find_map(|by| tried(gpu, &mut s, &[(moved, Vec3::new(by, -by, 0.0))]).err());
        let text = fault.unwrap_or_else(|| panic!("`{pass}` says nothing, and nobody notices")).to_string();
        assert!(text.contains("differs from a full run"), "`{pass}`: {text}");
    }
}

/// A step whose bits come late, read each other and belong to more instances than an axis has workgroups.
#[test]
fn instances_beyond_the_limit_of_an_axis_go_on_along_another() {
    let gpu = &device::gpu();
    let count = 70_000_u32;
    let graph = format!(
        r#"Graph(
        resources: {{
            "bits": Buffer(stride: 4, count: "ceil_div({count}, 32)"),
            "values": Buffer(stride: 4, count: {count}),
            "found": Texture(format: R32Float, size: (1, 1)),
        }},
        passes: [
            Compute(name: "mark", shader: "mark.wgsl", over: "bits"),
            Compute(name: "values", shader: "values.wgsl", each: {count}, over: (2, 1), only: Dirty(bits: "bits", of: ["nodes"])),
            Compute(name: "found", shader: "found.wgsl", over: (1, 1)),
        ],
        outputs: {{"found": "found"}},
    )"#
    );
    let node_rows = "struct Node { transform: mat4x4f }
        var<storage, read> nodes: array<Node>;
        fn height(row: u32) -> f32 { return nodes[row % arrayLength(&nodes)].transform[3].y; }";
    let mark = "#import lightgraph::moved::{ROWS, is_any}
        var<storage, read_write> bits: array<u32>;
        @compute @workgroup_size(64) fn mark(@builtin(global_invocation_id) id: vec3u) {
            var any = false;
            for (var i = 0u; i < ROWS; i++) { any |= is_any(i); }
            if id.x < arrayLength(&bits) { bits[id.x] = select(0u, 0xfffffffeu, any); }
        }";
    let values = format!(
        "#import lightgraph::instances
        {node_rows}
        var<storage, read_write> values: array<f32>;
        @compute @workgroup_size(1) fn main(@builtin(workgroup_id) group: vec3u) {{
            let instance = instances::number(group);
            // Instances that are a multiple of 32 depend on no node.
            let y = select(height(instance), 0.0, instance % 32u == 0u);
            if instances::within(group).x == 1u {{ values[instance] = y + f32(instance); }}
        }}"
    );
    let found = "var<storage, read> values: array<f32>;
        var found: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(1) fn main() {
            var sum = 0u;
            for (var i = 0u; i < arrayLength(&values); i++) { sum = sum * 31u + bitcast<u32>(values[i]); }
            textureStore(found, vec2u(0u), vec4f(f32(sum & 0xffffffu)));
        }";
    let shaders = [("mark", mark), ("values", values.as_str()), ("found", found)];
    let mut s = written(gpu, "folded", &graph, &shaders, &[]);
    let ball = node(&s, "ball");
    let r = frame(gpu, &mut s, &[]);
    assert_eq!(ran(&s, &r, "values"), Ran::Full);
    let first = s.image(gpu, "found").unwrap_or_else(|f| panic!("{f}"));
    let r = frame(gpu, &mut s, &[(ball, Vec3::new(0.0, 0.5, 0.0))]);
    assert_eq!(ran(&s, &r, "values"), Ran::Part(count - count.div_ceil(32)));
    assert!(s.image(gpu, "found").unwrap_or_else(|f| panic!("{f}")) != first);
    let r = frame(gpu, &mut s, &[]);
    assert_eq!(ran(&s, &r, "values"), Ran::Part(count - count.div_ceil(32)));
    assert!(s.image(gpu, "found").unwrap_or_else(|f| panic!("{f}")) == first);
}

/// The block that moves stands behind a wall for half of the probes; it also moves through the wall, and back.
#[test]
fn rays_are_not_traced_again_for_what_a_wall_hides() {
    let gpu = &device::gpu();
    let set = ["grid=4", "face=8", "bounces=1", "rays_above=0", "shadow_size=64"];
    let mut s = session(gpu, "fast_grid.ron", "two_rooms.glb", &set);
    let mut drawn = session(
        gpu,
        "fast_grid.ron",
        "two_rooms.glb",
        &set.map(|s| s.replace("rays_above=0", "face=8")).each_ref().map(|s| s.as_str()),
    );
    let block = node(&s, "lit_room_block");
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut drawn, &[]);
    for (by, hidden) in [
        (Vec3::new(0.1, 0.0, 0.0), true),
        (Vec3::new(0.2, 0.2, -0.2), true),
        (Vec3::new(2.0, 0.0, 0.4), false),
        (Vec3::ZERO, false),
    ] {
        let r = frame(gpu, &mut s, &[(block, by)]);
        let some = ran(&s, &r, "capture.capture_rays").part();
        let r = frame(gpu, &mut drawn, &[(block, by)]);
        let as_drawn = ran(&drawn, &r, "capture.capture").part();
        assert!(some > 0 && some <= as_drawn, "{some} faces by rays, {as_drawn} drawn");
        assert!(!hidden || some < as_drawn - 32, "the wall hides it from the other room: {some} of {as_drawn}");
    }
}

/// What a full run would draw is there too when a step runs for another reason while something hidden is out of its
/// place.
#[test]
fn what_moved_unseen_is_drawn_where_it_is_when_all_is_drawn_again() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "direct.ron", "two_rooms.glb", &["shadow_size=32"]);
    let block = node(&s, "dark_room_block");
    let shift = |light: f32, by: f32| Shift {
        lights: Vec3::new(light, 0.0, 0.0),
        nodes: vec![(block, Vec3::new(by, 0.0, 0.0))],
        ..Shift::default()
    };
    // The light is in the other room; in the third frame it comes over, to where it sees the block.
    for (i, (light, by)) in
        [(0.0, 0.0), (0.0, 0.2), (2.0, 0.2), (2.0, 0.0), (0.0, 0.0), (0.0, 0.3)].into_iter().enumerate()
    {
        s.shift = shift(light, by);
        s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("frame {i}: {f}"));
    }
}

#[test]
fn a_shadow_moves_only_in_the_maps_that_see_it() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "direct.ron", "cornell_point.gltf", &["shadow_size=64"]);
    s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let mut few = 0;
    for node in 0..s.scene.nodes.len() {
        if !s.scene.geometry.vertices.iter().any(|v| v.node as usize == node) {
            continue;
        }
        let r = frame(gpu, &mut s, &[(node, Vec3::new(0.0, 0.02, 0.01))]);
        few += u32::from(matches!(ran(&s, &r, "shadow.shadow_maps"), Ran::Part(some) if some > 0 && some < 6));
        frame(gpu, &mut s, &[]);
    }
    assert!(few > 0, "no object moved in some of the maps only");
}

/// A live edit of what a draw leaves out changes what it draws: a memory of the old map would be stale.
#[test]
fn leaving_out_other_occluders_draws_the_shadow_map_again() {
    let gpu = &device::gpu();
    let text = |occluders: &str| {
        format!(
            r#"Variant(
                base: "lightgraph:graphs/gi/direct.ron",
                passes: {{"shadow.shadow_maps": (occluders: {occluders})}},
            )"#
        )
    };
    let scratch = support::Scratch::new("occluders");
    let file = scratch.path().join("direct.ron");
    let mut s: Option<Session> = None;
    for occluders in ["true", "None", "true"] {
        std::fs::write(&file, text(occluders)).unwrap();
        let project = Project::open(&file, &[support::repository("shaders")]).unwrap_or_else(|f| panic!("{f}"));
        let next = match &s {
            None => open(gpu, &project, "hall.ron", &["shadow_size=64"], Settings::default()),
            Some(s) => Session::after(gpu, &project, s.scene.clone(), s.settings.clone(), Some(s))
                .unwrap_or_else(|f| panic!("{f}")),
        };
        let s = s.insert(next);
        let r = s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        assert_eq!(ran(s, &r, "shadow.shadow_maps"), Ran::Full);
    }
}
