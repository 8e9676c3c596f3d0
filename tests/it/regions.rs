//! What moves is drawn again only in the views that show it, before or after; every frame is compared with a full run.

use crate::{device, support};
use glam::{Mat4, Vec3};
use lightgraph::gpu::Gpu;
use lightgraph::plan::change::Why;
use lightgraph::plan::ingredient::Kind;
use lightgraph::plan::sight::meets;
use lightgraph::scene::{self, Bounds, Shift};
use lightgraph::session::{Project, Session, Settings};
use std::collections::BTreeSet;

fn session(gpu: &Gpu, graph: &str, scene: &str, set: &[&str]) -> Session {
    session_without(gpu, graph, scene, set, None)
}

fn session_without(gpu: &Gpu, graph: &str, scene: &str, set: &[&str], without: Option<Kind>) -> Session {
    let project = Project::open(&support::repository("graphs").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let loaded = scene::load(&support::repository("scenes").join(scene)).unwrap_or_else(|f| panic!("{f}"));
    let outputs = Some(vec!["color".to_string()]);
    let settings =
        Settings { params, size: [16, 12], outputs, skip: true, verify: true, without, ..Settings::default() };
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
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
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let scene = scene::load(&support::repository("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}")).scene;
    let settings = Settings { params, size: [16, 12], skip: true, verify: true, ..Settings::default() };
    Session::new(gpu, &project, scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

/// How many members of a pass ran in the last frame, and of how many; `None` when it did not run.
fn members(session: &Session, pass: &str) -> Option<(u32, u32)> {
    let mut steps = session.plan.steps.iter().zip(session.why());
    let (_, why) = steps.find(|(s, _)| s.name == pass).unwrap_or_else(|| panic!("no step `{pass}`"));
    match why {
        Why::Changed(names) => {
            let words: Vec<&str> = names[0].split(' ').collect();
            match words[..] {
                ["what", some, "of", all, "members", "see" | "read"] => {
                    Some((some.parse().unwrap(), all.parse().unwrap()))
                }
                _ => panic!("`{pass}` ran as a whole: {names:?}"),
            }
        }
        why if why.runs() => panic!("`{pass}` ran as a whole: {why}"),
        _ => None,
    }
}

/// The share of their texels that the members of a pass went over; `None` when it did not run, or over all of them.
fn window(session: &Session, pass: &str) -> Option<f64> {
    let mut steps = session.plan.steps.iter().zip(session.why());
    let (_, why) = steps.find(|(s, _)| s.name == pass).unwrap_or_else(|| panic!("no step `{pass}`"));
    let Why::Changed(names) = why else { return None };
    let text = names.get(1)?.strip_prefix("within ")?.strip_suffix(" % of their texels")?;
    Some(text.parse().unwrap_or_else(|e| panic!("{text}: {e}")))
}

/// The node of this name.
fn node(session: &Session, name: &str) -> usize {
    let mut nodes = session.scene.nodes.iter();
    nodes.position(|n| n.name == name).unwrap_or_else(|| panic!("no node `{name}`"))
}

fn frame(gpu: &Gpu, session: &mut Session, moved: &[(usize, Vec3)]) {
    session.shift.nodes = moved.to_vec();
    session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{moved:?}: {f}"));
}

#[test]
fn an_object_is_captured_again_only_by_the_faces_that_see_it() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "hall.ron", &["grid=3", "face=8", "bounces=1"]);
    let ball = node(&s, "ball");
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut s, &[(ball, Vec3::new(0.05, 0.1, 0.0))]);
    let (some, all) = members(&s, "capture").expect("the ball is in sight");
    assert_eq!(all, 27 * 6);
    // Every probe has a face that looks its way.
    assert!(some > 0 && some < 27, "{some} of {all} faces show the ball");
    // Nothing more moves: nothing more is drawn.
    frame(gpu, &mut s, &[(ball, Vec3::new(0.05, 0.1, 0.0))]);
    assert_eq!(members(&s, "capture"), None);
    frame(gpu, &mut s, &[]);
    assert_eq!(members(&s, "capture"), Some((some, all)), "back where it was, seen by the same faces");
}

/// Light is sent anew to faces that were captured anew and came out otherwise, as long as nothing else of it changed; many frames in a
/// row, so that what is left from before is of several frames.
#[test]
fn only_faces_that_were_captured_again_are_lit_again() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "hall.ron", &["grid=2", "face=8", "bounces=1", "shadow_size=256"]);
    let (corbel, ball) = (node(&s, "corbel"), node(&s, "ball"));
    frame(gpu, &mut s, &[]);
    for i in 1..4 {
        let by = Vec3::new(0.03 * i as f32, 0.0, 0.0);
        frame(gpu, &mut s, &[(corbel, by)]);
        let (some, all) = members(&s, "capture").expect("the corbel is in sight");
        assert!(some > 0 && some < all / 2, "{some} of {all} faces show the corbel");
        assert_eq!(members(&s, "shadow_maps"), None, "the light does not see the corbel");
        let (lit, _) = members(&s, "direct_at_probes").expect("some faces show it elsewhere");
        assert!(lit > 0 && lit <= some, "{lit} of {some} faces that show the corbel are lit again");
    }
    // The ball stands in the light: its shadow may fall anywhere.
    s.shift.nodes = vec![(ball, Vec3::new(0.1, 0.0, 0.0))];
    s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let lit = s.plan.steps.iter().position(|step| step.name == "direct_at_probes").unwrap();
    assert!(
        matches!(&s.why()[lit], Why::Changed(names) if names.contains(&"shadow_map".to_string())),
        "{}",
        s.why()[lit]
    );
}

/// Rays find the same faces as drawing does, and a probe is lit again when one of its faces is captured again.
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
        let by = Vec3::new(0.03 * i as f32, 0.0, 0.0);
        frame(gpu, &mut s, &[(corbel, by)]);
        frame(gpu, &mut drawn, &[(corbel, by)]);
        let (some, all) = members(&s, "capture_rays").expect("the corbel is in sight");
        assert!(some > 0 && some < all / 2, "{some} of {all} faces show the corbel");
        let (as_drawn, _) = members(&drawn, "capture").expect("the corbel is in sight");
        assert!(some.abs_diff(as_drawn) <= 2, "{some} faces by rays, {as_drawn} drawn");
        let (lit, probes) = members(&s, "first_bounce").expect("some probes see the corbel");
        assert!(lit > 0 && lit <= some && probes == 8, "{lit} of {probes} probes for {some} faces");
    }
    // Far through the hall, into the ball, out of the scene's box, and back.
    for by in [Vec3::new(0.0, -1.0, 2.0), Vec3::splat(40.0), Vec3::ZERO] {
        frame(gpu, &mut s, &[(corbel, by), (ball, 0.5 * by)]);
    }
}

/// What moves in the dark leaves the light that probes were lit by as it was; only probes that see it have anything new to send.
#[test]
fn an_object_in_the_dark_lights_again_only_the_probes_that_see_it() {
    let gpu = &device::gpu();
    let set = ["grid=4", "face=8", "bounces=2", "shadow_size=256"];
    let mut s = session(gpu, "fast_grid.ron", "hall.ron", &set);
    let (corbel, ball) = (node(&s, "corbel"), node(&s, "ball"));
    frame(gpu, &mut s, &[]);
    for i in 1..4 {
        frame(gpu, &mut s, &[(corbel, Vec3::new(0.03 * i as f32, 0.0, 0.0))]);
        let (first, all) = members(&s, "first_bounce").expect("some probes see the corbel");
        let (second, _) = members(&s, "second_bounce").expect("some probes see the corbel");
        assert!(first > 0 && second >= first && second < all, "{first} and {second} of {all} probes");
    }
    // Back where it was, all is as it was.
    let end = s.image(gpu, "color").unwrap_or_else(|f| panic!("{f}"));
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut s, &[(corbel, Vec3::new(0.09, 0.0, 0.0))]);
    assert!(s.image(gpu, "color").unwrap_or_else(|f| panic!("{f}")) == end);
    // What stands in the light changes the light of all, and every probe gathers it.
    frame(gpu, &mut s, &[(ball, Vec3::new(0.1, 0.2, 0.0))]);
    assert_eq!(members(&s, "second_bounce"), Some((64, 64)));
}

/// Where the first bounce of few probes comes out otherwise, only those need the second that take light from them or see something else.
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
            frame(gpu, &mut s, &[(corbel, Vec3::new(0.02 * i as f32, 0.0, 0.0))]);
            let (first, _) = members(&s, "first_bounce").expect("some probes see the corbel");
            if graph == "fast_grid.ron" {
                let (second, all) = members(&s, "second_bounce").expect("some probes see the corbel");
                assert!(second >= first && second < all, "{first} and {second} of {all} probes");
                // Light that changed at some of them is what the others take.
                few += u32::from(second > first);
            }
        }
        assert!(graph != "fast_grid.ron" || few > 0, "the first bounce came out the same everywhere, always");
    }
}

/// Where a view stands may follow from what another view shows.
#[test]
fn views_that_follow_from_what_others_show_are_looked_at_again() {
    let gpu = &device::gpu();
    let graph = r#"Graph(
        resources: {
            "down_views": Buffer(stride: 64, count: 1),
            "down": Atlas(format: Depth32Float, tile: 16, count: 1),
            "up_views": Buffer(stride: 64, count: 1),
            "up": Atlas(format: R32Float, tile: 16, count: 1),
        },
        passes: [
            Compute(name: "place_down", shader: "place_down.wgsl", over: "down_views"),
            Draw(name: "draw_down", shader: "draw_down.wgsl", each: 1, frusta: "down_views", depth: "down", cull: None),
            Compute(name: "place_up", shader: "place_up.wgsl", over: "up_views"),
            Compute(name: "trace_up", shader: "trace_up.wgsl", each: 1, over: (16, 16), frusta: "up_views"),
        ],
        outputs: {"up": "up"},
    )"#;
    let place = |views: &str, declared: &str, eye: &str, face: u32| {
        format!(
            "#import lightgraph::cube::view_projection
            {declared}
            var<storage, read_write> {views}: array<mat4x4f>;
            @compute @workgroup_size(1) fn main() {{ {views}[0] = view_projection({eye}, {face}u, 0.05, 30.0); }}"
        )
    };
    let draw = "#import lightgraph::geometry::world_position
        var<storage, read> down_views: array<mat4x4f>;
        @vertex fn main(@location(0) position: vec3f, @location(1) node: u32, @builtin(instance_index) view: u32)
            -> @builtin(position) vec4f { return down_views[view] * vec4f(world_position(node, position), 1.0); }";
    let mean = "var down: texture_depth_2d;
        fn mean() -> f32 {
            var sum = 0.0;
            for (var i = 0u; i < 256u; i++) { sum += textureLoad(down, vec2u(i % 16u, i / 16u), 0) / 256.0; }
            return sum;
        }";
    // Of all that stands above it shows nothing but from where.
    let trace = "var<storage, read> up_views: array<mat4x4f>;
        var<storage, read> members: array<u32>;
        var up: texture_storage_2d<r32float, write>;
        @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u) {
            textureStore(up, id.xy, vec4f(up_views[members[id.z]][3].x));
        }";
    let down = place("down_views", "", "vec3f(0.0, 3.0, 0.0)", 3);
    let up = place("up_views", mean, "vec3f(100.0 * (mean() - 0.98), 3.0, 0.0)", 2);
    let shaders = [("place_down", down.as_str()), ("draw_down", draw), ("place_up", &up), ("trace_up", trace)];
    let mut s = written(gpu, "followed", graph, &shaders, &[]);
    let ball = node(&s, "ball");
    let mut seen = vec![];
    for by in [0.0, 0.1, 0.3, 0.6, 1.0] {
        frame(gpu, &mut s, &[(ball, Vec3::new(0.0, by, 0.0))]);
        seen.push(s.image(gpu, "up").unwrap_or_else(|f| panic!("{f}")));
    }
    assert!(seen.windows(2).all(|two| two[0] != two[1]), "the second view stands elsewhere in every frame");
}

/// Which part a member reads follows from its own row, and so does its row of the mask.
#[test]
fn members_read_the_parts_that_their_mask_chose_last() {
    let gpu = &device::gpu();
    let graph = r#"Graph(
        resources: {
            "values": Buffer(stride: 4, count: 64),
            "mask": Buffer(stride: 4, count: 128),
            "found": Texture(format: R32Float, size: (64, 1)),
        },
        passes: [
            Compute(name: "values", shader: "values.wgsl", each: 64, over: (1, 1), rows: {"nodes": "1"}),
            Compute(name: "mask", shader: "mask.wgsl", each: 64, over: (1, 1), rows: {"nodes": "1"}),
            Compute(name: "choose", shader: "choose.wgsl", each: 64, over: (1, 1), masked: {"values": "mask"}, rows: {"nodes": "1"}),
        ],
        outputs: {"found": "found"},
    )"#;
    let node = "struct Node { transform: mat4x4f }
        var<storage, read> nodes: array<Node>;
        var<storage, read> members: array<u32>;
        fn chosen(member: u32) -> u32 { return u32(abs(floor(nodes[member].transform[3].y))) % 64u; }";
    let entry = "@compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u)";
    let member = "let member = members[id.z];";
    let shaders = [
        ("values", "var<storage, read_write> values: array<f32>;", "values[member] = nodes[member].transform[3].x;"),
        (
            "mask",
            "var<storage, read_write> mask: array<u32>;",
            "let part = chosen(member);
            for (var word = 0u; word < 2u; word++) {
                mask[2u * member + word] = select(0u, 1u << (part % 32u), part / 32u == word);
            }",
        ),
        (
            "choose",
            "var<storage, read> values: array<f32>; var found: texture_storage_2d<r32float, write>;",
            "textureStore(found, vec2u(member, 0u), vec4f(values[chosen(member)]));",
        ),
    ];
    let texts = shaders.map(|(_, declared, does)| format!("{node}\n{declared}\n{entry} {{ {member}\n{does} }}"));
    let shaders: Vec<(&str, &str)> = shaders.iter().zip(&texts).map(|(s, text)| (s.0, text.as_str())).collect();
    let mut s = written(gpu, "chosen", graph, &shaders, &[]);
    let (along, up) = (|x: f32| Vec3::new(x, 0.0, 0.0), |y: f32| Vec3::new(0.0, y, 0.0));
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut s, &[(9, along(1.0))]);
    assert_eq!(members(&s, "values"), Some((1, 64)));
    let (few, _) = members(&s, "choose").expect("one has moved");
    assert!(few < 32, "{few} members read one part");
    // Two choose the value of number 9, then it changes; then so many that the mask is read anew.
    let offset = |s: &Session, node: usize| 9.5 - s.scene.nodes[node].translation.y;
    for count in [2, 12] {
        let chosen: Vec<(usize, Vec3)> = (20..20 + count).map(|node| (node, up(offset(&s, node)))).collect();
        for x in [1.0, 2.0, 3.0] {
            frame(gpu, &mut s, &[&chosen[..], &[(9, along(x))]].concat());
        }
        let ran = members(&s, "choose").expect("one has moved");
        assert!(ran.0 as usize > count && ran.0 < 32, "{ran:?}, {count} of them by choice");
    }
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut s, &[(9, along(4.0))]);
}

/// A mask that leaves out what a member reads is found out: the probes that it takes light from, the squares of shadow maps that it looks into.
#[test]
fn the_proof_catches_a_mask_that_says_too_little() {
    let gpu = &device::gpu();
    for (mask, when, moves, step) in [
        ("reach", "second_apart && by_face", "corbel", 0.1),
        ("shadow_reach", "bounces > 0 && by_probe && lights > 0 && shadows == 0 && light_views <= 16", "urn", 0.02),
    ] {
        let graph = format!(
            r#"Variant(
                base: "lightgraph:graphs/fast_grid.ron",
                passes: {{
                    "{mask}": Compute(
                        shader: "none.wgsl", when: "{when}", each: "probes", over: (1, 1), own: ["cube_surface"],
                    ),
                }},
            )"#
        );
        let shader = format!(
            "#import lightgraph::packed_surface::surface_at
            var<storage, read> members: array<u32>;
            var<storage, read_write> {mask}: array<u32>;
            @compute @workgroup_size(1) fn none(@builtin(global_invocation_id) id: vec3u) {{
                let words = arrayLength(&{mask}) / 512u;
                for (var i = 0u; i < words; i++) {{
                    {mask}[members[id.z] * words + i] = u32(surface_at(vec2u(0u)).normal.w < -1e9);
                }}
            }}"
        );
        let mut s = written(gpu, mask, &graph, &[("none", &shader)], &["grid=8", "face=8", "shadow_size=256"]);
        let moved = node(&s, moves);
        frame(gpu, &mut s, &[]);
        let mut moved = |by: f32| {
            s.shift.nodes = vec![(moved, Vec3::new(by, -by, 0.0))];
            s.frame(gpu, 0, 0.0)
        };
        let faults = [1.0, 2.0, 3.0, 5.0, 10.0, 15.0].iter().find_map(|by| moved(*by * step).err());
        let text = faults.unwrap_or_else(|| panic!("`{mask}`: light that changes is not found")).to_string();
        assert!(text.contains("differs from a full run"), "{text}");
    }
}

/// Where something moves in the light, only probes are lit again that see it or look into the squares of the shadow maps that it changed.
#[test]
fn an_object_in_the_light_lights_again_only_the_probes_that_its_shadow_may_reach() {
    let gpu = &device::gpu();
    // A spot light; a point light, of six maps.
    for (scene, name, moves) in [("hall.ron", "ball", 0.02), ("cornell_point.gltf", "short", 0.01)] {
        let set = ["grid=4", "face=8", "bounces=2", "shadow_size=256", "rays_above=0"];
        let mut s = session(gpu, "fast_grid.ron", scene, &set);
        let object = node(&s, name);
        frame(gpu, &mut s, &[]);
        let mut lit = vec![];
        for i in 1..5 {
            frame(gpu, &mut s, &[(object, Vec3::new(moves * i as f32, 0.0, 0.0))]);
            assert!(window(&s, "shadow_maps").is_some(), "{scene}");
            lit.push(members(&s, "first_bounce").expect("it is in sight").0);
        }
        assert!(lit.iter().all(|some| *some > 0) && lit.iter().any(|some| *some < 64), "{scene}: {lit:?} of 64 probes");
        // The light itself lights all of them.
        s.shift.lights = Vec3::new(0.0, -0.05, 0.0);
        s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let first = s.plan.steps.iter().position(|step| step.name == "first_bounce").unwrap();
        assert!(matches!(&s.why()[first], Why::Changed(names) if !names[0].starts_with("what ")), "{}", s.why()[first]);
    }
}

/// Rays that pass by what moved meet what they met, and are not traced: those too that met it where it was are others.
#[test]
fn the_proof_catches_rays_that_are_not_traced_where_things_were() {
    let gpu = &device::gpu();
    let set = ["grid=2", "face=8", "bounces=1", "shadow_size=256"];
    let mut s = session_without(gpu, "fast_grid.ron", "hall.ron", &set, Some(Kind::Moved));
    let corbel = node(&s, "corbel");
    frame(gpu, &mut s, &[]);
    let mut moved = |by: f32| {
        s.shift.nodes = vec![(corbel, Vec3::new(0.0, -by, 0.0))];
        s.frame(gpu, 0, 0.0)
    };
    let faults = [1.0, 2.0].iter().find_map(|by| moved(*by).err());
    let text = faults.expect("what stood there is still seen").to_string();
    assert!(text.contains("differs from a full run"), "{text}");
}

/// Results that are taken for those of before without a look are found out.
#[test]
fn the_proof_catches_results_that_are_not_compared() {
    let gpu = &device::gpu();
    let set = ["grid=4", "face=8", "bounces=2", "shadow_size=256"];
    let mut s = session_without(gpu, "fast_grid.ron", "hall.ron", &set, Some(Kind::Result));
    let corbel = node(&s, "corbel");
    frame(gpu, &mut s, &[]);
    let moved = |s: &mut Session, by: f32| {
        s.shift.nodes = vec![(corbel, Vec3::new(by, -by, 0.0))];
        s.frame(gpu, 0, 0.0)
    };
    let faults = [0.25, 0.5, 1.0, 1.5, 2.0].iter().find_map(|by| moved(&mut s, *by).err());
    let text = faults.expect("light that changes is taken for the same").to_string();
    assert!(text.contains("differs from a full run"), "{text}");
}

/// What stands still keeps its place among the triangles for rays, whatever moves.
#[test]
fn rays_do_not_see_what_a_wall_hides() {
    let gpu = &device::gpu();
    let set = ["grid=4", "face=8", "bounces=1", "rays_above=0", "shadow_size=64"];
    let mut s = session(gpu, "fast_grid.ron", "two_rooms.glb", &set);
    let mut drawn =
        session(gpu, "fast_grid.ron", "two_rooms.glb", &set.map(|s| if s == "rays_above=0" { "face=8" } else { s }));
    let block = node(&s, "lit_room_block");
    frame(gpu, &mut s, &[]);
    frame(gpu, &mut drawn, &[]);
    for by in [Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.2, 0.2, -0.2), Vec3::new(2.0, 0.0, 0.4), Vec3::ZERO] {
        frame(gpu, &mut s, &[(block, by)]);
        frame(gpu, &mut drawn, &[(block, by)]);
        let (some, all) = members(&s, "capture_rays").expect("half of the probes see it");
        let (as_drawn, _) = members(&drawn, "capture").expect("half of the probes see it");
        assert!(some > 0 && some < all && some.abs_diff(as_drawn) <= 4, "{some} faces by rays, {as_drawn} drawn");
    }
}

/// Simplified triangles move with their nodes as all others do.
#[test]
fn an_object_of_fewer_triangles_is_captured_again_in_the_same_way() {
    let gpu = &device::gpu();
    let set = ["grid=2", "face=8", "bounces=1", "shadow_size=256", "capture_tolerance=0.02"];
    let mut s = session(gpu, "uniform_grid.ron", "hall.ron", &set);
    let level = s.plan.levels[0];
    assert!(level.triangles > 0 && level.triangles as usize * 3 < s.scene.geometry.indices.len(), "{level:?}");
    let ball = node(&s, "ball");
    frame(gpu, &mut s, &[]);
    for i in 1..3 {
        frame(gpu, &mut s, &[(ball, Vec3::new(0.1 * i as f32, 0.0, 0.0))]);
        assert!(members(&s, "capture").is_some_and(|(some, all)| some > 0 && some < all));
    }
}

/// The tiles of a pass over the screen are members too.
#[test]
fn a_screen_pass_draws_again_only_the_tiles_whose_source_changed() {
    let gpu = &device::gpu();
    let graph = r#"Variant(
        base: "lightgraph:graphs/uniform_grid.ron",
        resources: {"halves": Atlas(format: Rgba32Float, tile: "face", count: "probes * 6")},
        after: {"capture": [Screen(name: "halve", shader: "halve.wgsl", each: "probes * 6", own: ["cube_albedo"])]},
        outputs: {"halves": "halves"},
    )"#;
    let shader = "var cube_albedo: texture_2d<f32>;
        struct Out { @location(0) halves: vec4f }
        @fragment fn halve(@builtin(position) at: vec4f) -> Out {
            return Out(0.5 * textureLoad(cube_albedo, vec2u(at.xy), 0));
        }";
    let mut s = written(gpu, "halves", graph, &[("halve", shader)], &["grid=2", "face=8"]);
    let corbel = node(&s, "corbel");
    frame(gpu, &mut s, &[]);
    let halves = |s: &Session| s.image(gpu, "halves").unwrap_or_else(|f| panic!("{f}"));
    let mut before = halves(&s);
    for i in 1..4 {
        frame(gpu, &mut s, &[(corbel, Vec3::new(0.03 * i as f32, 0.0, 0.0))]);
        let (captured, all) = members(&s, "capture").expect("the corbel is in sight");
        assert!(captured > 0 && captured < all / 2, "{captured} of {all} faces show the corbel");
        let now = halves(&s);
        // Tiles are 8 texels wide.
        let texels = now.data.chunks_exact(4).zip(before.data.chunks_exact(4)).enumerate();
        let tile = |texel: u32| (texel % now.width / 8, texel / now.width / 8);
        let other: BTreeSet<(u32, u32)> =
            texels.filter(|(_, (a, b))| a != b).map(|(texel, _)| tile(texel as u32)).collect();
        let drawn = members(&s, "halve").map_or(0, |(some, _)| some);
        assert!(drawn == other.len() as u32 && drawn <= captured, "{drawn} tiles, {} differ", other.len());
        before = now;
    }
}

/// The faces of probes at these places whose frusta meet a box at one of two places.
fn faces(probes: &[Vec3], boxes: [Bounds; 2]) -> u32 {
    let views = probes.iter().flat_map(|eye| {
        [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|look| {
            let up = if look.y == 0.0 { Vec3::Y } else { Vec3::Z };
            let frustum = Mat4::perspective_rh(std::f32::consts::FRAC_PI_2, 1.0, 0.005, 10.0);
            frustum * Mat4::look_to_rh(*eye, look, up)
        })
    });
    views.filter(|view| boxes.iter().any(|b| meets(view, b))).count() as u32
}

/// The block that moves stands behind a wall for half of the probes; it also moves through the wall, and back.
#[test]
fn what_lies_behind_a_wall_is_not_captured_again() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "two_rooms.glb", &["grid=4", "face=8", "bounces=1"]);
    let block = node(&s, "lit_room_block");
    // The rooms are 2 m wide; the probes stand in the middle of cells of 1 by 0.5 by 0.5 m.
    let places =
        (0..64).map(|i| Vec3::new((i % 4) as f32 - 1.5, 0.25 + 0.5 * (i / 4 % 4) as f32, 0.5 * (i / 16) as f32 - 0.75));
    let (lit, dark): (Vec<Vec3>, Vec<Vec3>) = places.partition(|p| p.x < 0.0);
    let at = |by: Vec3| Bounds { min: Vec3::new(-1.26, -0.01, -0.46) + by, max: Vec3::new(-0.74, 0.71, 0.06) + by };
    frame(gpu, &mut s, &[]);
    let mut before = Vec3::ZERO;
    for by in [Vec3::new(0.1, 0.0, 0.0), Vec3::new(0.2, 0.2, -0.2)] {
        frame(gpu, &mut s, &[(block, by)]);
        let (some, all) = members(&s, "capture").expect("half of the probes see it");
        let most = faces(&lit, [at(before), at(by)]);
        assert!(some > 0 && some <= most && all == 384, "{some} of {all} faces show the block at {by}, at most {most}");
        assert!(faces(&dark, [at(before), at(by)]) > 32, "what the wall hides lies in no frustum");
        before = by;
    }
    let other_room = Vec3::new(2.0, 0.0, 0.4);
    frame(gpu, &mut s, &[(block, other_room)]);
    let there = members(&s, "capture").expect("it was in one room and is in the other");
    frame(gpu, &mut s, &[(block, other_room + 0.1)]);
    let (some, _) = members(&s, "capture").expect("half of the probes see it");
    let most = faces(&dark, [at(other_room), at(other_room + 0.1)]);
    assert!(some > 0 && some <= most, "{some} faces show the block in the other room, at most {most}");
    frame(gpu, &mut s, &[(block, before)]);
    let (back, _) = members(&s, "capture").expect("it was in one room and is in the other");
    assert!(back > some && there.0 > some, "{back} and {} faces in both rooms, {some} in one", there.0);
}

/// What a full run would draw is there too when a step runs for another reason while something hidden is out of its place.
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
        match i {
            1 | 5 => assert_eq!(members(&s, "shadow_maps"), None, "frame {i}: a wall stands between light and block"),
            3 => assert!(members(&s, "shadow_maps").is_some(), "frame {i}: the light sees the block"),
            _ => {}
        }
    }
}

#[test]
fn a_shadow_moves_only_in_the_maps_that_see_it() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "direct.ron", "cornell_point.gltf", &["shadow_size=64"]);
    s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let (mut some, mut none) = (0, 0);
    for node in 0..s.scene.nodes.len() {
        if !s.scene.geometry.vertices.iter().any(|v| v.node as usize == node) {
            continue;
        }
        s.shift.nodes = vec![(node, Vec3::new(0.0, 0.02, 0.01))];
        s.frame(gpu, 1, 0.0).unwrap_or_else(|f| panic!("{f}"));
        match members(&s, "shadow_maps") {
            Some((few, 6)) if few < 6 => some += 1,
            Some(_) => {}
            None => none += 1,
        }
        s.shift.nodes = vec![];
        s.frame(gpu, 2, 0.0).unwrap_or_else(|f| panic!("{f}"));
    }
    assert!(some > 0, "no object moved in some of the maps only ({none} in none)");
}

/// Of a shadow map the part is drawn again round which something moved; what lies round it stays as it is. Large moves and another
/// light draw all of it.
#[test]
fn a_part_of_a_shadow_map_is_drawn_again() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "direct.ron", "hall.ron", &["shadow_size=256"]);
    let (ball, corbel) = (node(&s, "ball"), node(&s, "corbel"));
    frame(gpu, &mut s, &[]);
    assert_eq!(window(&s, "shadow_maps"), None);
    let mut parts = vec![];
    for by in [0.02, 0.04, 0.4, 0.0] {
        frame(gpu, &mut s, &[(ball, Vec3::new(by, 0.0, 0.0))]);
        assert_eq!(members(&s, "shadow_maps"), Some((1, 1)), "the ball stands in the light");
        parts.push(window(&s, "shadow_maps").expect("it is small"));
    }
    assert!(parts[0] > 0.0 && parts[0] < 10.0, "{parts:?} % of the map");
    assert!(parts[2] > parts[1], "where it was and where it is: {parts:?}");
    // It moves while the light does, then alone.
    s.shift.lights = Vec3::new(0.1, 0.0, 0.0);
    frame(gpu, &mut s, &[(ball, Vec3::new(0.0, 0.1, 0.0))]);
    assert_eq!(window(&s, "shadow_maps"), None);
    frame(gpu, &mut s, &[(ball, Vec3::new(0.0, 0.2, 0.0))]);
    assert!(window(&s, "shadow_maps").is_some());
    // What the light does not see moves at once with it.
    frame(gpu, &mut s, &[(ball, Vec3::new(0.0, 0.1, 0.0)), (corbel, Vec3::new(0.05, 0.0, 0.0))]);
    assert!(window(&s, "shadow_maps").is_some());
    frame(gpu, &mut s, &[(corbel, Vec3::new(0.05, 0.0, 0.0))]);
    assert!(window(&s, "shadow_maps").is_some());
}

/// Faces that see what moved draw it within what it covered and covers, with all of their targets.
#[test]
fn parts_of_faces_are_captured_again() {
    let gpu = &device::gpu();
    let mut s = session(gpu, "uniform_grid.ron", "hall.ron", &["grid=2", "face=16", "bounces=1", "shadow_size=64"]);
    let ball = node(&s, "ball");
    frame(gpu, &mut s, &[]);
    for i in 1..5 {
        frame(gpu, &mut s, &[(ball, Vec3::new(0.03 * i as f32, 0.02, 0.0))]);
        let (some, all) = members(&s, "capture").expect("the ball is in sight");
        assert!(some < all, "{some} of {all} faces");
        let part = window(&s, "capture").expect("it is small");
        assert!(part > 0.0 && part < 60.0, "{part} % of the faces");
    }
}

/// A part that leaves out where something was is found out.
#[test]
fn the_proof_catches_parts_that_are_too_small() {
    let gpu = &device::gpu();
    let mut s = session_without(gpu, "direct.ron", "hall.ron", &["shadow_size=256"], Some(Kind::Moved));
    let ball = node(&s, "ball");
    frame(gpu, &mut s, &[]);
    s.shift.nodes = vec![(ball, Vec3::new(0.5, 0.0, 0.0))];
    let text = s.frame(gpu, 0, 0.0).expect_err("what stood there is still seen").to_string();
    assert!(text.contains("differs from a full run"), "{text}");
}

/// What rays meet is copied row by row: again for the rows that moved.
#[test]
fn tables_are_read_again_where_rows_changed() {
    let gpu = &device::gpu();
    let set = ["grid=2", "face=4", "bounces=1", "rays_above=0", "shadow_size=64"];
    let mut s = session(gpu, "fast_grid.ron", "hall.ron", &set);
    let ball = node(&s, "ball");
    frame(gpu, &mut s, &[]);
    for by in [0.03, 0.06, 0.0] {
        frame(gpu, &mut s, &[(ball, Vec3::new(by, 0.0, 0.0))]);
        let (some, all) = members(&s, "trace_texels").expect("the ball's triangles moved");
        assert!(some > 0 && some <= all / 4, "{some} of {all} rows of texels");
    }
    // In another session they are known for the same, wherever things stand.
    frame(gpu, &mut s, &[(ball, Vec3::new(0.09, 0.0, 0.0))]);
    let project = Project::open(&support::repository("graphs/fast_grid.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let shift = s.shift.clone();
    let mut s =
        Session::after(gpu, &project, s.scene.clone(), s.settings.clone(), Some(&s)).unwrap_or_else(|f| panic!("{f}"));
    s.shift = shift;
    s.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(members(&s, "trace_texels"), None);
    frame(gpu, &mut s, &[]);
    assert!(members(&s, "trace_texels").is_some_and(|(some, all)| some > 0 && some <= all / 4));
    s.shift.lights = Vec3::new(0.1, 0.0, 0.0);
    frame(gpu, &mut s, &[]);
    assert_eq!(members(&s, "trace_texels"), None);
}
