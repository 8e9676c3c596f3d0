//! A graph of 1,000 passes is parsed, checked and planned while a hand leaves the key.

use lightgraph::Project;
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::plan::build::{Planned, plan};
use lightgraph::internals::plan::fastest::FIRST;
use lightgraph::internals::plan::request::{Request, sample_facts};
use lightgraph::internals::shader::Library;
use lightgraph::internals::value::Values;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// The time that this thread has computed, whoever else uses the machine; without Linux's books, the time of the clock.
fn computed() -> Duration {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let start = *START.get_or_init(Instant::now);
    let books = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = books.split(' ').next().and_then(|n| n.parse().ok());
    nanoseconds.map_or_else(|| start.elapsed(), Duration::from_nanos)
}

const PASSES: usize = 1000;

/// A chain: each pass reads what the one before it made, some take one of eight shaders, some are left out.
fn text() -> String {
    let mut resources = String::new();
    let mut passes = String::new();
    for i in 0..PASSES {
        // Writing to a string can't fail.
        let _ =
            writeln!(resources, "        \"r{i}\": Texture(format: Rgba16Float, size: \"screen / {}\"),", 1 + i % 2);
        let _ = match i {
            0 => writeln!(passes, "        Clear(name: \"p0\", target: \"r0\", value: (1, 0, 0, 1)),"),
            _ => writeln!(
                passes,
                "        Screen(name: \"p{i}\", shader: \"s{}.wgsl\", color: \"r{i}\", bind: {{\"input\": \"r{}\"}}, when: \"amount > {}\"),",
                i % 8,
                i - 1,
                i as f64 / 1e6 - 1.0
            ),
        };
    }
    format!(
        "Graph(\n    about: \"A long chain\",\n    params: {{\"amount\": Float(default: 0.5, about: \"of each\")}},\n    resources: {{\n{resources}    }},\n    \
         passes: [\n{passes}    ],\n    outputs: {{\"color\": \"r{}\"}},\n)",
        PASSES - 1
    )
}

fn shaders() -> Library {
    let mut library = Library::default();
    let mut add = |name: String, text: String| drop(library.files.insert(name.clone(), Source::new(name, text)));
    add(
        "lib/mix.wgsl".into(),
        "#define_import_path mixed\nvar<uniform> amount: f32;\nfn mixed(c: vec4f) -> vec4f { return c * amount; }\n"
            .into(),
    );
    for i in 0..8 {
        let text = format!(
            "#import mixed::mixed\nvar input: texture_2d<f32>;\n@fragment fn main(@builtin(position) at: vec4f) -> @location(0) vec4f {{\n    \
             return mixed(textureLoad(input, vec2u(at.xy), 0)) + {i}.0;\n}}\n"
        );
        add(format!("s{i}.wgsl"), text);
    }
    library
}

/// Runs of which the mean is taken: the books on a thread are kept in steps of some milliseconds.
const RUNS: u32 = 20;

/// The mean time of `work` in the best of three rows of runs, in milliseconds.
fn timed<T>(mut work: impl FnMut() -> T) -> f64 {
    let row = |work: &mut dyn FnMut() -> T| {
        let start = computed();
        (0..RUNS).for_each(|_| drop(work()));
        (computed() - start) / RUNS
    };
    let best = [row(&mut work), row(&mut work), row(&mut work)].into_iter().min();
    best.unwrap_or_default().as_secs_f64() * 1e3
}

#[test]
fn a_thousand_passes_are_planned_at_once() {
    let text = text();
    let load = || {
        let read = |_: &Path| Ok(Source::new("long.ron", text.as_str()));
        graph::load(Path::new("long.ron"), &read).unwrap_or_else(|f| panic!("{f}"))
    };
    let project = Project { graph: load(), texts: shaders() };
    let planned = || {
        plan(&Request {
            graph: &project.graph,
            texts: &project.texts,
            params: &Values::new(),
            facts: &sample_facts(true),
            screen: [640, 480],
            outputs: None,
            choices: &FIRST,
            levels: &[],
            limits: &wgpu::Limits::default(),
            features: wgpu::Features::FLOAT32_FILTERABLE,
        })
        .unwrap_or_else(|f| panic!("{f}"))
    };
    let Planned { plan, .. } = planned();
    assert_eq!((plan.steps.len(), plan.shaders.len()), (PASSES, 8));
    // Two sizes, of each what is read and what is written.
    assert_eq!(plan.slots.len(), 2, "{:?}", plan.slots);
    let (read, plan) = (timed(load), timed(planned));
    println!("{PASSES} passes: parse and check {read:.1} ms, plan {plan:.1} ms (mean of {RUNS})");
    // Without optimisation only what is out of all proportion shows.
    let most = if cfg!(debug_assertions) { 1000.0 } else { 10.0 };
    assert!(read + plan < most, "{:.1} ms", read + plan);
}
