//! Prefix sums, compaction and sorting on the device, against their twins; counts that a buffer gives, also hostile
//! ones.

use crate::device;
use crate::support::Scratch;
use lightgraph::internals::plan::Action;
use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
use std::fs;
use std::sync::Arc;

const LISTS: &str = r#"Graph(
    params: {"n": Uint(default: 1, min: 1, max: 100000000), "bits": Uint(default: 32, min: 1, max: 32)},
    inputs: {
        "flags": Buffer(element: "u32", count: "n"),
        "numbers": Buffer(element: "u32", count: "n"),
        "values": Buffer(element: "u32", count: "n"),
        "floats": Buffer(element: "f32", count: "n"),
    },
    resources: {
        "before": Buffer(element: "u32", count: "numbers"),
        "up_to": Buffer(element: "u32", count: "numbers"),
        "floats_up_to": Buffer(element: "f32", count: "floats"),
    },
    passes: [
        Scan(name: "sum_before", from: "numbers", to: "before"),
        Scan(name: "sum_up_to", from: "numbers", to: "up_to", inclusive: true),
        Scan(name: "sum_floats", from: "floats", to: "floats_up_to", inclusive: true),
        Use(name: "some", graph: "lightgraph:graphs/lists/compact.ron", set: {"workgroup": "32", "corners": "6"}),
        Use(name: "sort", graph: "lightgraph:graphs/lists/radix_sort.ron", in: {"keys": "numbers"}, set: {"bits": "bits"}),
    ],
    outputs: {
        "before": "before", "up_to": "up_to", "floats_up_to": "floats_up_to",
        "list": "some.list", "count": "some.count", "dispatch": "some.dispatch", "draw": "some.draw",
        "keys": "sort.keys", "values": "sort.values",
    },
)"#;

/// Numbers without a pattern, the same each time.
fn random(n: usize, mut state: u32) -> Vec<u32> {
    let mut next = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    (0..n).map(|_| next()).collect()
}

fn buffer(gpu: &Gpu, words: &[u32]) -> wgpu::Buffer {
    let desc = wgpu::BufferDescriptor {
        label: None,
        size: 4 * words.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    };
    let buffer = gpu.device.create_buffer(&desc);
    gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(words));
    buffer
}

fn session(gpu: &Gpu, graph: &str, shaders: &[(&str, &str)], set: &[String]) -> Checked<Session> {
    let scratch = Scratch::new("lists");
    fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    fs::write(scratch.path().join("graph.ron"), graph).unwrap();
    for (name, text) in shaders {
        fs::write(scratch.path().join("shaders").join(name), text).unwrap();
    }
    let project = Project::open(&scratch.path().join("graph.ron"), &[])?;
    let params = project.params(set)?;
    let settings = Settings { params, size: [8, 8], skip: true, verify: true, ..Settings::default() };
    Session::new(gpu, &project, Arc::new(Scene::stand_in()?.scene), settings)
}

/// The flags, numbers to sum up and to sort, and floats of a case.
struct Lists {
    flags: Vec<u32>,
    numbers: Vec<u32>,
    values: Vec<u32>,
    floats: Vec<u32>,
}

impl Lists {
    fn of(numbers: Vec<u32>, flags: Vec<u32>) -> Lists {
        let values = (0..numbers.len() as u32).map(|i| i ^ 0x5555).collect();
        let floats = numbers.iter().map(|n| (((n % 1000) as f32) / 8.0).to_bits()).collect();
        Lists { flags, numbers, values, floats }
    }

    /// Whether the device makes what the twins make.
    fn hold(&self, gpu: &Gpu, bits: u32) {
        let n = self.numbers.len();
        let mut session =
            session(gpu, LISTS, &[], &[format!("n={n}"), format!("bits={bits}")]).unwrap_or_else(|f| panic!("{f}"));
        let lists =
            [("flags", &self.flags), ("numbers", &self.numbers), ("values", &self.values), ("floats", &self.floats)];
        for (name, words) in lists {
            session.import(gpu, name, buffer(gpu, words), 0).unwrap_or_else(|f| panic!("{f}"));
        }
        session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let words = |name: &str| session.words(gpu, name).unwrap_or_else(|f| panic!("{f}"));
        let hold = |name: &str, expected: &[u32]| {
            let found = words(name);
            let differs = found.iter().zip(expected).position(|(a, b)| a != b);
            assert!(
                differs.is_none() && found.len() >= expected.len(),
                "{n} elements, {bits} bits: `{name}` from {differs:?} on"
            );
        };

        let mut sum = 0u32;
        let mut before = vec![];
        for number in &self.numbers {
            before.push(sum);
            sum = sum.wrapping_add(*number);
        }
        let up_to: Vec<u32> = before.iter().zip(&self.numbers).map(|(a, b)| a.wrapping_add(*b)).collect();
        hold("before", &before);
        hold("up_to", &up_to);

        let listed: Vec<u32> = (0..n as u32).filter(|i| self.flags[*i as usize] == 1).collect();
        let found = listed.len() as u32;
        hold("list", &listed);
        hold("count", &[found]);
        hold("dispatch", &[found.div_ceil(32), 1, 1]);
        hold("draw", &[6, found, 0, 0]);

        let low =
            |key: u32| if bits.next_multiple_of(8) >= 32 { key } else { key & ((1 << bits.next_multiple_of(8)) - 1) };
        let mut pairs: Vec<(u32, u32)> = self.numbers.iter().copied().zip(self.values.iter().copied()).collect();
        pairs.sort_by_key(|(key, _)| low(*key));
        hold("keys", &pairs.iter().map(|p| p.0).collect::<Vec<_>>());
        hold("values", &pairs.iter().map(|p| p.1).collect::<Vec<_>>());

        let mut exact = 0.0f64;
        for (i, (x, found)) in self.floats.iter().zip(words("floats_up_to")).enumerate() {
            exact += f64::from(f32::from_bits(*x));
            let error = (f64::from(f32::from_bits(found)) - exact).abs();
            // A sum of a block is made of 2048 roundings, as a whole of far fewer than the elements.
            assert!(error <= 1e-5 * exact, "element {i} of {n}: {}, not {exact}", f32::from_bits(found));
        }
    }
}

#[test]
fn lists_on_the_device_are_those_of_the_host() {
    let gpu = &*device::gpu();
    for n in [1, 2, 255, 256, 257, 1023, 1024, 1025, 2048, 2049, 65_537] {
        let numbers = random(n, n as u32);
        let flags = numbers.iter().map(|x| u32::from(x % 3 == 0)).collect();
        Lists::of(numbers, flags).hold(gpu, 32);
    }
}

#[test]
fn a_million_elements_are_listed_and_sorted() {
    let numbers = random(1_000_003, 7);
    let flags = numbers.iter().map(|x| (x >> 16) & 1).collect();
    Lists::of(numbers, flags).hold(&device::gpu(), 32);
}

#[test]
fn ties_keep_their_order_and_all_or_none_are_listed() {
    let gpu = &*device::gpu();
    let n = 5000;
    Lists::of(random(n, 1).iter().map(|x| x % 7).collect(), vec![1; n]).hold(gpu, 32);
    Lists::of(vec![u32::MAX; n], vec![0; n]).hold(gpu, 32);
    Lists::of((0..n as u32).rev().collect(), vec![0; n]).hold(gpu, 16);
    // Higher bits make no difference then.
    Lists::of(random(n, 2), vec![1; n]).hold(gpu, 5);
}

#[test]
fn sums_take_one_step_or_three() {
    let gpu = &*device::gpu();
    for (n, steps) in [(1, 1), (2048, 1), (2049, 3), (3_000_000, 3)] {
        let session = session(gpu, LISTS, &[], &[format!("n={n}")]).unwrap_or_else(|f| panic!("{f}"));
        let of = |pass: &str| session.plan.steps.iter().filter(|s| s.pass == pass).count();
        assert_eq!((of("sum_before"), of("sum_up_to")), (steps, steps), "{n} elements");
    }
    let fault =
        session(gpu, &LISTS.replace("min: 1", "min: 0"), &[], &["n=0".into()]).err().expect("no elements").to_string();
    assert!(fault.contains("a number of elements is 0"), "{fault}");
}

const COUNTED: &str = r#"Graph(
    inputs: {"groups": Buffer(element: "u32", count: 3), "drawn": Buffer(element: "u32", count: 4)},
    resources: {
        "reached": Buffer(element: "u32", count: 16, initial: 0),
        "color": Texture(format: R32Float, size: 8),
    },
    passes: [
        Compute(name: "reach", shader: "reach.wgsl", over: (8, 2, 1), indirect: "groups"),
        Draw(
            name: "show", shader: "show.wgsl", vertices: 6, instances: 8, indirect: "drawn", topology: Points,
            color: "color",
        ),
    ],
    outputs: {"reached": "reached", "color": "color"},
)"#;

const REACH: &str = "var<storage, read_write> reached: array<u32>;
@compute @workgroup_size(2) fn reach(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    reached[id.y * 8u + id.x] = 100u * groups.x + 10u * groups.y + groups.z;
}";

const SHOW: &str = "struct Point { @builtin(position) at: vec4f, @location(0) @interpolate(flat) number: u32 }
@vertex fn place(@builtin(vertex_index) i: u32, @builtin(instance_index) instance: u32) -> Point {
    return Point(vec4f((f32(i) + 0.5) / 4.0 - 1.0, 1.0 - (f32(instance) + 0.5) / 4.0, 0.5, 1.0), 10u * instance + i + 1u);
}
@fragment fn shade(p: Point) -> @location(0) f32 { return f32(p.number); }";

/// What a dispatch over two axes and a draw of 8 × 6 points reach by these counts.
fn reached(gpu: &Gpu, groups: [u32; 3], drawn: [u32; 4]) -> (Vec<u32>, Vec<u32>) {
    let shaders = [("reach.wgsl", REACH), ("show.wgsl", SHOW)];
    let mut session = session(gpu, COUNTED, &shaders, &[]).unwrap_or_else(|f| panic!("{f}"));
    session.import(gpu, "groups", buffer(gpu, &groups), 0).unwrap_or_else(|f| panic!("{f}"));
    session.import(gpu, "drawn", buffer(gpu, &drawn), 0).unwrap_or_else(|f| panic!("{f}"));
    session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
    let image = session.image(gpu, "color").unwrap_or_else(|f| panic!("{f}"));
    let points = image.data.iter().map(|x| *x as u32).collect();
    (session.words(gpu, "reached").unwrap_or_else(|f| panic!("{f}")), points)
}

/// The same by the host, with counts cut off at what the passes allow.
fn expected([x, y, z]: [u32; 3], [vertices, instances, first, first_instance]: [u32; 4]) -> (Vec<u32>, Vec<u32>) {
    let [x, y, z] = [x.min(4), y.min(2), z.min(1)];
    let (first, first_instance) = (first.min(6), first_instance.min(8));
    let (end, end_instance) = (first + vertices.min(6 - first), first_instance + instances.min(8 - first_instance));
    let word = |i: u32| if i % 8 < 2 * x && i / 8 < y && z > 0 { 100 * x + 10 * y + z } else { 0 };
    let texel = |i: u32| {
        let (vertex, instance) = (i % 8, i / 8);
        let there = (first..end).contains(&vertex) && (first_instance..end_instance).contains(&instance);
        if there { 10 * instance + vertex + 1 } else { 0 }
    };
    ((0..16).map(word).collect(), (0..64).map(texel).collect())
}

#[test]
fn counts_of_a_buffer_are_kept_within_what_a_pass_allows() {
    const MOST: u32 = u32::MAX;
    let gpu = &*device::gpu();
    assert!(gpu.features.contains(wgpu::Features::INDIRECT_FIRST_INSTANCE), "draws begin at any instance");
    let cases = [
        ([4, 2, 1], [6, 8, 0, 0]),
        ([3, 1, 1], [2, 3, 1, 2]),
        ([0, 2, 1], [0, 8, 0, 0]),
        ([1, 1, 0], [6, 0, 3, 1]),
        ([MOST; 3], [MOST, MOST, 0, 0]),
        ([MOST, 1, 2], [MOST, MOST, 5, 7]),
        ([2, MOST, MOST], [MOST; 4]),
        ([1, 1, 1], [1, 1, MOST - 1, MOST - 1]),
        ([5, 3, 2], [7, 9, MOST, 2]),
    ];
    for (groups, drawn) in cases {
        assert_eq!(reached(gpu, groups, drawn), expected(groups, drawn), "{groups:?} {drawn:?}");
    }
}

#[test]
fn what_a_buffer_counts_is_an_input_of_the_pass() {
    let gpu = &*device::gpu();
    let shaders = [("reach.wgsl", REACH), ("show.wgsl", SHOW)];
    let mut session = session(gpu, COUNTED, &shaders, &[]).unwrap_or_else(|f| panic!("{f}"));
    let runs = |session: &mut Session, groups: [u32; 3], version| {
        session.import(gpu, "groups", buffer(gpu, &groups), version).unwrap_or_else(|f| panic!("{f}"));
        let report = session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let ran: Vec<&str> = report.steps.iter().map(|s| session.plan.steps[s.step].pass.as_str()).collect();
        (ran.contains(&"reach"), session.words(gpu, "reached").unwrap_or_else(|f| panic!("{f}"))[0])
    };
    assert_eq!(runs(&mut session, [4, 2, 1], 0), (true, 421));
    assert_eq!(runs(&mut session, [2, 1, 1], 1), (true, 211));
    let bounds = |s: &&lightgraph::internals::plan::Step| matches!(s.action, Action::Compute { indirect: Some(_), .. });
    let step = session.plan.steps.iter().find(bounds).expect("a dispatch by counts");
    assert!(step.reads.len() >= 2, "it reads the counts, as the pass says and within bounds");
}
