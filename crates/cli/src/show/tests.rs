//! Small graphs and one that ships, shown in every way.

use super::layout::{NetworkLayout, layout};
use super::network::network;
use super::*;
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph::load;
use lightgraph::internals::plan::build;
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::{Request, sample_device, sample_facts};
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Value;
use lightgraph::{Graph, Plan, Project};
use std::collections::BTreeSet;
use std::path::Path;

/// Writes `there`.
const MAKE: &str = "
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn make(@builtin(global_invocation_id) id: vec3u) { textureStore(there, id.xy, vec4f(1.0)); }
";

/// Reads `here`, writes `there`.
const TURN: &str = "
var here: texture_2d<f32>;
var there: texture_storage_2d<r32float, write>;
@compute @workgroup_size(8, 8)
fn turn(@builtin(global_invocation_id) id: vec3u) { textureStore(there, id.xy, textureLoad(here, id.xy, 0)); }
";

/// Holds what is there against what was.
const MEASURE: &str = "
var here: texture_2d<f32>;
var before: texture_2d<f32>;
var<storage, read_write> change: array<f32>;
@compute @workgroup_size(1)
fn measure() { change[0] = abs(textureLoad(here, vec2u(0), 0).r - textureLoad(before, vec2u(0), 0).r); }
";

/// Pieces of an image, taken apart and put together again until it hardly changes.
const SETTLING: &str = r#"Graph(
    params: {
        "pieces": Uint(default: 9, min: 1, max: 16, about: "of the image"),
        "rounds": Uint(default: 2, min: 0, max: 9, about: "at most"),
        "epsilon": Float(default: 0.002, min: 0.0, max: 1.0, about: "a change that is none"),
    },
    resources: {
        "mean": Texture(format: R32Float, size: 8),
        "before": Texture(format: R32Float, size: 8),
        "parts": Atlas(format: R32Float, tile: 8, count: 1, members: "pieces"),
        "change": Buffer(stride: 4, count: 1),
        "image": Texture(format: R32Float, size: 8),
        "shown": Texture(format: R32Float, size: 8),
    },
    passes: [
        Compute(name: "start", shader: "make.wgsl", over: "mean", bind: {"there": "mean"}),
        Loop(name: "settle", count: "rounds", until: "change < epsilon", passes: [
            Copy(name: "keep", from: "mean", to: "before"),
            Compute(name: "split", shader: "turn.wgsl", each: "pieces", over: "parts", bind: {"here": "before", "there": "parts"}),
            Compute(name: "join", shader: "turn.wgsl", each: "pieces", over: "mean", bind: {"here": "parts", "there": "mean"}),
            Compute(name: "measure", shader: "measure.wgsl", over: (1, 1, 1), bind: {"here": "mean"}),
        ]),
        Compute(name: "settled", shader: "turn.wgsl", when: "rounds > 0", over: "image", bind: {"here": "mean", "there": "image"}),
        Compute(name: "unsettled", shader: "make.wgsl", when: "rounds == 0", over: "image", bind: {"there": "image"}),
        Compute(name: "show", shader: "turn.wgsl", over: "shown", bind: {"here": "image", "there": "shown"}),
    ],
    outputs: {"shown": "shown"},
)"#;

/// The plan of a graph of these shaders.
fn plan_of(text: &str, params: &[(&str, Value)]) -> Plan {
    let source = Source::new("test.ron", text.to_string());
    let graph = load(Path::new("test.ron"), &|_| Ok(source.clone())).unwrap_or_else(|f| panic!("{f}"));
    let file = |(path, text): (&str, &str)| (path.to_string(), Source::new(path, text.to_string()));
    let files = [("make.wgsl", MAKE), ("turn.wgsl", TURN), ("measure.wgsl", MEASURE)].into_iter().map(file).collect();
    planned(&graph, &Library { files, ..Library::default() }, params)
}

fn planned(graph: &Graph, texts: &Library, params: &[(&str, Value)]) -> Plan {
    let (limits, features) = sample_device();
    let request = Request {
        graph,
        texts,
        params: &params.iter().map(|(name, value)| ((*name).to_string(), *value)).collect(),
        facts: &sample_facts(true),
        screen: [64, 48],
        outputs: None,
        choices: &FIRST,
        levels: &[],
        limits: &limits,
        features,
    };
    build::plan(&request).unwrap_or_else(|f| panic!("{f}")).plan
}

fn settling(params: &[(&str, Value)]) -> Plan {
    plan_of(SETTLING, params)
}

/// A compute pass that writes one resource.
fn make(name: &str, to: &str) -> String {
    format!("Compute(name: \"{name}\", shader: \"make.wgsl\", over: \"{to}\", bind: {{\"there\": \"{to}\"}}),")
}

/// A compute pass that reads one resource and writes another.
fn turn(name: &str, from: &str, to: &str) -> String {
    let bind = format!("{{\"here\": \"{from}\", \"there\": \"{to}\"}}");
    format!("Compute(name: \"{name}\", shader: \"turn.wgsl\", over: \"{to}\", bind: {bind}),")
}

/// Equal images.
fn images(names: &[&str]) -> String {
    names.iter().map(|n| format!("\"{n}\": Texture(format: R32Float, size: 8),")).collect()
}

/// The plan of resources, passes and outputs.
fn sample(resources: &str, passes: &str, outputs: &str) -> Plan {
    let text = format!("Graph(resources: {{{resources}}}, passes: [{passes}], outputs: {{{outputs}}})");
    plan_of(&text, &[])
}

/// A pass before a loop over two, one that is skipped.
fn small() -> Plan {
    let body = turn("there", "x", "y") + &turn("back", "y", "x");
    let passes = make("start", "x") + &format!("Loop(name: \"n\", count: 3, passes: [{body}]),") + &make("lost", "z");
    sample(&images(&["x", "y", "z"]), &passes, "\"result\": \"x\"")
}

/// A graph of the repository.
fn direct() -> Plan {
    let project = Project::open(&crate::repository("graphs/gi/direct.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    planned(&project.graph, &project.texts, &[])
}

#[test]
fn a_small_plan_reads_like_this() {
    let text = small().to_string();
    let shown: Vec<&str> = text.lines().skip_while(|l| *l != "steps").collect();
    let wanted = "\
steps
  start                      compute  make.wgsl                1×1×1 groups       → x
  loop n × 3
    there                    compute  turn.wgsl                1×1×1 groups       x → y
    back                     compute  turn.wgsl                1×1×1 groups       y → x

skipped
  lost                       no requested output needs it

resources
  x                          R32Float 8×8                       256 B          slot 0   start … end
  y                          R32Float 8×8                       256 B          slot 1   there … back

memory
  512 B in 2 slots; 512 B for 2 resources unshared: 0.0 % saved

outputs
  result                     x";
    assert_eq!(shown.join("\n"), wanted);
}

#[test]
fn equal_steps_of_a_set_are_one_line() {
    let text = settling(&[]).to_string();
    assert!(text.contains("loop settle × 2 until change < 0.002"), "{text}");
    assert!(text.contains("for each i of 0…8"), "{text}");
    assert!(text.contains("parts[0…8]"), "{text}");
    assert!(!text.contains("split[3]"), "{text}");
}

#[test]
fn text_json_dot_and_svg_are_the_same_each_time() {
    let (a, b) = (settling(&[]), settling(&[]));
    assert_eq!(a.to_string(), b.to_string());
    assert_eq!(to_json(&a).to_string(), to_json(&b).to_string());
    assert_eq!(to_dot(&a), to_dot(&b));
    assert_eq!(to_svg(&a), to_svg(&b));
}

#[test]
fn json_names_every_step_and_resource() {
    let plan = settling(&[]);
    let json = to_json(&plan);
    let length = |key: &str| json[key].as_array().map_or(0, Vec::len);
    assert_eq!(length("steps"), plan.steps.len());
    assert_eq!(length("resources"), plan.resources.len());
    assert_eq!(length("slots"), plan.slots.len());
    assert_eq!(json["parameters"][0], serde_json::json!({"name": "pieces", "value": 9}));
    assert_eq!(json["memory"]["bytes"], plan.bytes().0);
    let last = json["order"].as_array().and_then(|o| o.iter().find(|n| n.is_object())).cloned().unwrap_or_default();
    assert_eq!((&last["loop"], &last["count"]), (&"settle".into(), &2.into()));
    assert_eq!(last["until"]["comparison"], "<");
}

#[test]
fn dot_is_balanced_and_declares_what_it_links() {
    for plan in [small(), settling(&[]), settling(&[("rounds", Value::Uint(0))])] {
        let dot = to_dot(&plan);
        // No name in these graphs has a brace.
        assert_eq!(dot.matches('{').count(), dot.matches('}').count(), "{dot}");
        let declared: BTreeSet<&str> =
            dot.lines().filter_map(|l| l.trim().split_once(" [label=").map(|l| l.0)).collect();
        let links = dot.lines().filter_map(|l| l.trim().split_once(" [")?.0.split_once(" -> "));
        let mut count = 0;
        for (from, to) in links {
            assert!(declared.contains(from) && declared.contains(to), "{from} -> {to} in\n{dot}");
            count += 1;
        }
        assert!(count > 1, "{dot}");
    }
}

#[test]
fn dot_shows_what_an_iteration_leaves_to_the_next_as_dashed() {
    let dot = to_dot(&small());
    assert_eq!(dot.matches("style=dashed, constraint=false").count(), 1, "{dot}");
    assert!(dot.contains("lost\\nno requested output needs it"), "{dot}");
}

#[test]
fn dot_indents_what_a_loop_holds() {
    let dot = to_dot(&small());
    let indent = |what: &str| {
        let line = dot.lines().find(|l| l.contains(what)).unwrap_or_else(|| panic!("no {what} in\n{dot}"));
        line.len() - line.trim_start().len()
    };
    assert!(indent("label=\"back\\n") > indent("subgraph cluster_0"), "{dot}");
    assert_eq!(indent("label=\"start\\n"), indent("subgraph cluster_0"), "{dot}");
}

/// The elements of an XML text.
///
/// # Panics
/// Tags that are not nested, marks that stand for themselves.
fn elements(xml: &str) -> usize {
    let (mut open, mut count) = (vec![], 0);
    for part in xml.split('<').skip(1) {
        let (tag, text) = part.split_once('>').unwrap_or_else(|| panic!("no end of <{part}"));
        assert!(!text.contains('>'), "a bare mark in {text}");
        for entity in text.split('&').skip(1) {
            let name = entity.split(';').next().unwrap_or("");
            assert!(["amp", "lt", "gt", "quot"].contains(&name), "&{entity}");
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "<{tag}>");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "</{name}>");
        } else if !tag.ends_with('/') {
            open.push(tag.split([' ', '\n']).next().unwrap_or(""));
        }
        count += 1;
    }
    assert!(open.is_empty(), "{open:?} are not closed");
    count
}

#[test]
fn svg_is_well_formed_whatever_the_names() {
    for mut plan in [small(), settling(&[]), settling(&[("rounds", Value::Uint(0))])] {
        plan.graph = "a <b> & \"c\"\u{1}.ron".into();
        let svg = to_svg(&plan);
        assert!(elements(&svg) > 20, "{svg}");
        assert!(svg.contains("a &lt;b&gt; &amp; &quot;c&quot; .ron"), "{svg}");
    }
}

/// The layout of a plan whose passes have some extent.
fn laid(plan: &Plan) -> NetworkLayout {
    let net = network(plan, &BTreeSet::new());
    let extents: Vec<_> = net.passes.iter().map(|p| picture::extent(&net, p)).collect();
    layout(&net, &extents)
}

#[test]
fn no_box_lies_on_another_and_no_wire_runs_through_one() {
    for plan in [small(), settling(&[]), direct()] {
        let laid = laid(&plan);
        let boxes: Vec<_> = laid.passes.values().collect();
        for (i, a) in boxes.iter().enumerate() {
            for b in &boxes[i + 1..] {
                let beside = a.x + a.width <= b.x || b.x + b.width <= a.x;
                assert!(beside || a.y + a.height <= b.y || b.y + b.height <= a.y, "{a:?} and {b:?}");
            }
            for wire in &laid.wires {
                for pair in wire.points.windows(2) {
                    let inside = |x: f32| x > a.x && x < a.x + a.width;
                    let through = pair[0][1] < a.y + a.height - 0.5 && pair[1][1] > a.y + 0.5;
                    let straight = (pair[0][0] - pair[1][0]).abs() < 0.05;
                    assert!(!(straight && through && inside(pair[0][0])), "{a:?} and {:?}", wire.points);
                }
            }
        }
    }
}

#[test]
fn wires_lead_downwards() {
    for plan in [small(), settling(&[]), direct()] {
        for wire in laid(&plan).wires {
            let down = wire.points.windows(2).all(|pair| pair[0][1] <= pair[1][1] + 0.05);
            assert!(down, "{:?}", wire.points);
        }
    }
}

#[test]
fn loops_frame_their_passes() {
    let plan = settling(&[]);
    let (net, laid) = (network(&plan, &BTreeSet::new()), laid(&plan));
    let [(title, frame)] = &laid.loops[..] else { panic!("one loop") };
    assert_eq!(title, "settle × 2 until change < 0.002");
    for (i, r) in &laid.passes {
        let across = r.x >= frame.x && r.x + r.width <= frame.x + frame.width;
        let down = r.y >= frame.y && r.y + r.height <= frame.y + frame.height;
        let name = net.passes[*i].name.split('[').next().unwrap_or_default();
        let within = ["keep", "split", "join", "measure"].contains(&name);
        assert_eq!(across && down, within, "{name}");
    }
}

#[test]
fn a_plan_does_not_differ_from_itself() {
    let plan = settling(&[]);
    assert!(diff(&plan, &plan).ends_with("no difference\n"), "{}", diff(&plan, &plan));
}

#[test]
fn a_difference_names_what_was_added_taken_and_changed() {
    let shown = diff(&settling(&[]), &settling(&[("pieces", Value::Uint(4)), ("rounds", Value::Uint(3))]));
    for line in [
        "  - pieces                   9",
        "  + pieces                   4",
        "  - settle                   loop settle × 2 until change < 0.002",
        "  + settle                   loop settle × 3 until change < 0.002",
    ] {
        assert!(shown.contains(line), "{line} in\n{shown}");
    }
    assert!(!shown.contains(" show "), "{shown}");
    let fewer = diff(&settling(&[]), &settling(&[("rounds", Value::Uint(0))]));
    assert!(fewer.contains("\n  + unsettled ") && fewer.contains("\n  - join"), "{fewer}");
    assert!(fewer.contains("\nmemory\n  allocated "), "{fewer}");
}

#[test]
fn a_difference_names_outputs_that_are_other_resources() {
    let plan = |outputs: &str| sample(&images(&["x", "y"]), &(make("a", "x") + &turn("b", "x", "y")), outputs);
    let shown = diff(&plan("\"o\": \"y\", \"p\": \"x\""), &plan("\"o\": \"y\", \"p\": \"y\", \"q\": \"x\""));
    let (_, outputs) = shown.split_once("\noutputs\n").unwrap_or_else(|| panic!("{shown}"));
    let lines: Vec<String> =
        outputs.lines().take(3).map(|l| l.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    assert_eq!(lines, ["- p x", "+ p y", "+ q x"], "{shown}");
}

#[test]
fn a_box_holds_the_steps_of_a_pass_and_clears_before_the_frame_have_their_own() {
    // A long plan shows what its members have in common.
    for members in [1, 100] {
        let set = |name: &str, more: &str| {
            format!("\"{name}\": Texture(format: R32Float, size: 8, members: {members}{more}),")
        };
        let each = |pass: String| pass.replace("over:", &format!("each: {members}, over:"));
        let passes = each(turn("a", "x", "y")) + &each(turn("b", "y", "z"));
        let resources = set("x", ", initial: 1") + &set("y", "") + &set("z", "");
        let plan = sample(&resources, &passes, "\"o\": \"z\"");
        let net = network(&plan, &BTreeSet::new());
        let inside = net.passes.iter().filter(|p| p.kind != "output");
        let boxes: Vec<(&str, usize)> = inside.map(|p| (p.name.as_str(), p.steps.len())).collect();
        if members == 1 {
            assert!(boxes.iter().all(|b| b.1 == 1) && boxes.len() == plan.steps.len(), "{boxes:?}");
        } else {
            assert_eq!(boxes, [("x = initial", 100), ("a", 100), ("b", 100)]);
        }
    }
}

#[test]
fn a_collapsed_sub_graph_is_one_box_and_hides_what_it_keeps_to_itself() {
    let mut plan = settling(&[]);
    for step in plan.steps.iter_mut().filter(|s| s.pass != "show") {
        step.pass = format!("inner.{}", step.pass);
        step.name = format!("inner.{}", step.name);
    }
    assert_eq!(network::sub_graphs("a.b.blur").collect::<Vec<_>>(), ["a", "a.b"]);
    let net = network(&plan, &BTreeSet::from(["inner".to_string()]));
    let box_ = net.passes.iter().find(|p| p.name == "inner").unwrap();
    assert_eq!(box_.kind, network::COLLAPSED);
    let left: Vec<&str> = box_.ports.iter().map(|p| net.ports[*p].resource.as_str()).collect();
    assert_eq!(left, ["image"]);
    assert_eq!(net.passes.iter().filter(|p| p.name.starts_with("inner")).count(), 1);
    // Whatever is collapsed, there are places for all boxes.
    assert_eq!(picture::picture(&plan, &BTreeSet::from(["inner".to_string()])).boxes.len(), net.passes.len());
}
