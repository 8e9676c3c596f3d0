//! What a stranger's project may try: the command ends by itself, with a fault and a code, within time and memory.

use crate::support::{Scratch, ended, repository};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Nothing here may take longer, on however busy a machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// A graph of one dispatch.
fn graph(shader: &str) -> String {
    format!(
        "Graph(about: \"One dispatch.\", resources: {{\"data\": Buffer(stride: 4, count: 4)}}, \
         passes: [Compute(name: \"p\", shader: \"{shader}\", over: \"4\")], outputs: {{\"data\": \"data\"}})"
    )
}

fn shader(constants: &str, statements: &str) -> String {
    format!(
        "{constants}var<storage, read_write> data: array<f32>;\n\
         @compute @workgroup_size(1) fn main() {{\nvar x = 1.0;\ndata[0] = x;\n{statements}\n}}\n"
    )
}

/// A project with a graph and its shader.
fn project(name: &str, constants: &str, statements: &str) -> Scratch {
    let scratch = Scratch::new(name);
    fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    fs::write(scratch.path().join("g.ron"), graph("a.wgsl")).unwrap();
    fs::write(scratch.path().join("shaders/a.wgsl"), shader(constants, statements)).unwrap();
    scratch
}

/// Runs the command in a folder, with 2 GiB of addresses besides what it needs to start; its code and what it prints.
fn run(folder: &Path, args: &[&str]) -> (i32, String) {
    let limited = "ulimit -v 4194304; exec \"$0\" \"$@\"";
    let mut command = Command::new("sh");
    command.args(["-c", limited, env!("CARGO_BIN_EXE_lightgraph")]).args(args).current_dir(folder);
    let nowhere = repository("tests/no-such-driver.json");
    command.env("VK_ICD_FILENAMES", &nowhere).env("VK_DRIVER_FILES", &nowhere);
    command.env("XDG_CACHE_HOME", folder.join("cache"));
    let printed = folder.join("printed.txt");
    let file = File::create(&printed).unwrap();
    command.stdin(Stdio::null()).stdout(file.try_clone().unwrap()).stderr(file);
    let mut child = command.spawn().unwrap();
    let status = ended(&mut child, PATIENCE).unwrap_or_else(|| panic!("{args:?} does not end"));
    let mut text = String::new();
    File::open(&printed).unwrap().take(1 << 20).read_to_string(&mut text).unwrap();
    assert!(!text.contains("panicked") && !text.contains("overflowed"), "{args:?}\n{text}");
    let code = status.code().unwrap_or_else(|| panic!("{args:?} was killed: {status}\n{text}"));
    (code, text)
}

#[track_caller]
fn expect(folder: &Path, args: &[&str], code: i32, words: &[&str]) {
    let (found, text) = run(folder, args);
    assert_eq!(found, code, "{args:?}\n{text}");
    for word in words {
        assert!(text.contains(word), "{args:?} doesn't say `{word}`:\n{text}");
    }
    assert!(text.len() < 100_000, "{args:?} prints {} bytes", text.len());
}

#[test]
fn deep_shaders_end_no_process() {
    let deep = project("hostile-deep", "", &format!("data[0] = x{};", "+x".repeat(12_000)));
    expect(deep.path(), &["check", "g.ron"], 1, &["a.wgsl:5:", "more than 1000 operators"]);
    let doubled: String = (1..26).map(|i| format!("const c{i} = array(c{0}, c{0});\n", i - 1)).collect();
    let doubled = project("hostile-doubled", &format!("const c0 = array(1.0, 2.0);\n{doubled}"), "");
    expect(doubled.path(), &["check", "g.ron"], 1, &["a.wgsl:1", "more than 65536 parts"]);
}

/// Every pass reads what the next one writes: each is a fault, and for each a circle is looked for.
#[test]
fn a_graph_in_the_wrong_order_is_refused_in_time() {
    let scratch = project("hostile-order", "", "");
    let shader = "var input: texture_2d<f32>;\n@fragment fn main(@builtin(position) at: vec4f) -> @location(0) vec4f { \
                  return textureLoad(input, vec2u(at.xy), 0); }";
    fs::write(scratch.path().join("shaders/s.wgsl"), shader).unwrap();
    let resources: String =
        (0..1000).map(|i| format!("\"r{i}\": Texture(format: Rgba16Float, size: \"screen\"),")).collect();
    let pass = |i: usize| {
        format!("Screen(name: \"p{i}\", shader: \"s.wgsl\", color: \"r{i}\", bind: {{\"input\": \"r{}\"}}),", i - 1)
    };
    let passes: String = (1..1000).rev().map(pass).collect();
    let clear = "Clear(name: \"p0\", target: \"r0\", value: (1, 0, 0, 1))";
    let text = format!(
        "Graph(about: \"a\", resources: {{{resources}}}, passes: [{passes}{clear}], outputs: {{\"color\": \"r999\"}})"
    );
    fs::write(scratch.path().join("g.ron"), text).unwrap();
    expect(scratch.path(), &["check", "g.ron"], 1, &["writes only later", "more are not shown"]);
}

#[test]
fn thousands_of_faults_on_one_line_are_a_page() {
    let scratch = project("hostile-faults", "", "");
    let params: String = (0..900).map(|i| format!("\"p{i}\": Float(default: 1.0, about: \"unused\"),")).collect();
    let text = graph("a.wgsl").replace("resources:", &format!("params: {{{params}}}, resources:"));
    fs::write(scratch.path().join("g.ron"), text).unwrap();
    expect(scratch.path(), &["check", "--strict", "g.ron"], 1, &["more are not shown"]);
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_waited_for() {
    let scratch = project("hostile-pipes", "", "");
    let pipe = |name: &str| {
        let made = Command::new("mkfifo").arg(scratch.path().join(name)).status().unwrap();
        assert!(made.success());
    };
    pipe("graph.ron");
    expect(scratch.path(), &["check", "graph.ron"], 1, &["graph.ron", "not a regular file"]);
    expect(scratch.path(), &["check", "/dev/zero"], 1, &["not a regular file"]);
    expect(scratch.path(), &["compare", "/dev/zero", "/dev/zero"], 1, &["not a regular file"]);
    expect(scratch.path(), &["plan", "g.ron", "--scene", "graph.ron"], 1, &["not a regular file"]);
    pipe("scene.gltf");
    expect(scratch.path(), &["plan", "g.ron", "--scene", "scene.gltf"], 1, &["not a regular file"]);
    pipe("results.json");
    expect(scratch.path(), &["bench", "--page", "results.json", "--out", "out"], 1, &["not a regular file"]);
    pipe("shaders/unused.wgsl");
    expect(scratch.path(), &["check", "g.ron"], 1, &["unused.wgsl", "not a regular file"]);
    fs::remove_file(scratch.path().join("shaders/unused.wgsl")).unwrap();
    expect(scratch.path(), &["check", "g.ron"], 0, &["no faults"]);
}

/// A base may be a link, but to a file of its own folder.
#[cfg(unix)]
#[test]
fn a_base_that_leads_out_of_its_folder_is_refused() {
    use std::os::unix::fs::symlink;
    let scratch = project("hostile-base", "", "");
    let inner = scratch.path().join("inner");
    fs::create_dir_all(&inner).unwrap();
    symlink(scratch.path().join("shaders"), inner.join("shaders")).unwrap();
    symlink(scratch.path().join("g.ron"), inner.join("out.ron")).unwrap();
    symlink("out.ron", inner.join("again.ron")).unwrap();
    for base in ["out.ron", "again.ron", "../g.ron"] {
        fs::write(inner.join("v.ron"), format!("Variant(base: \"{base}\", about: \"a\")")).unwrap();
        let args = ["check", "inner/v.ron", "--shaders", "shaders"];
        expect(scratch.path(), &args, 1, &["v.ron:1:16", "must lie in the folder of its variant", "--allow-outside"]);
        expect(scratch.path(), &[&args[..], &["--allow-outside"]].concat(), 0, &["no faults"]);
    }
    fs::copy(scratch.path().join("g.ron"), inner.join("own.ron")).unwrap();
    symlink("own.ron", inner.join("within.ron")).unwrap();
    fs::write(inner.join("v.ron"), "Variant(base: \"within.ron\", about: \"a\")").unwrap();
    expect(scratch.path(), &["check", "inner/v.ron", "--shaders", "shaders"], 0, &["no faults"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_under_the_output_is_an_error() {
    for args in [&["plan", "graphs/gi/direct.ron"][..], &["check", "graphs/gi/direct.ron"], &["compare", "--help"]] {
        let mut command = crate::support::command();
        command.args(args).stdout(File::options().write(true).open("/dev/full").unwrap());
        let output = command.output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr);
        // Help is printed by the parser of arguments, which has its own code for it.
        if args[1] != "--help" {
            assert_eq!(output.status.code(), Some(1), "{args:?}: {text}");
            assert!(text.contains("can't write the output"), "{args:?}: {text}");
        }
    }
}

#[test]
fn a_reader_that_goes_away_ends_the_output_only() {
    let mut command = crate::support::command();
    command.args(["plan", "graphs/gi/uniform_grid.ron"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn wrong_values_are_wrong_usage() {
    let scratch = project("hostile-usage", "", "");
    expect(scratch.path(), &["check", "g.ron", "--set", "nothing=1"], 2, &["no parameter `nothing`"]);
    expect(scratch.path(), &["plan", "g.ron", "--set", "nothing"], 2, &["NAME=VALUE"]);
    let plane = repository("scenes/lambert_plane.glb");
    let plane = plane.to_str().unwrap();
    let direct = repository("graphs/gi/direct.ron");
    let render = ["render", direct.to_str().unwrap(), "--scene", plane];
    let with = |more: &[&'static str]| [&render[..], more].concat();
    expect(scratch.path(), &with(&["--out", "n.exr", "--output", "direct=./n.exr"]), 2, &["both go to"]);
    expect(scratch.path(), &with(&["--out", "n.png", "--exposure", "nan"]), 2, &["--exposure"]);
}

#[cfg(unix)]
#[test]
fn what_steers_a_terminal_does_not_reach_it() {
    let scratch = project("hostile-terminal", "", "");
    let text = graph("a.wgsl")
        .replace("One dispatch.", "\u{1b}]0;title\u{7}")
        .replace("name: \"p\"", "nmae: \"\u{202e}p\u{1b}[2J\"");
    fs::write(scratch.path().join("g\u{1b}[31m.ron"), text).unwrap();
    let (code, printed) = run(scratch.path(), &["check", "g\u{1b}[31m.ron"]);
    assert_eq!(code, 1);
    assert!(!printed.contains(['\u{1b}', '\u{7}', '\u{202e}']), "{printed:?}");
}

#[cfg(unix)]
#[test]
fn an_adapter_that_is_no_text_is_asked_for_too() {
    use std::os::unix::ffi::OsStrExt;
    let output = crate::support::command()
        .args(["render", "graphs/gi/direct.ron", "--scene", "scenes/lambert_plane.glb", "--size", "8x8", "--out"])
        .arg(Scratch::new("hostile-adapter").path().join("a.png"))
        .env("WGPU_ADAPTER_NAME", std::ffi::OsStr::from_bytes(b"\xff\xfe"))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
}

/// With an adapter: what is written is looked at.
#[test]
fn numbers_that_are_not_finite_are_told() {
    let scratch = project("hostile-finite", "", "");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let shader = "var<uniform> red: f32;\nstruct Image { @location(0) color: vec4f }\n\
                  @fragment fn fragment(@builtin(position) at: vec4f) -> Image { return Image(vec4f(red * at.x, 0.0, 0.0, 1.0)); }";
    fs::write(at("shaders/fill.wgsl"), shader).unwrap();
    let graph = "Graph(about: \"a\", params: {\"red\": Float(default: 3e38, about: \"red\")}, \
                 resources: {\"color\": Texture(format: Rgba32Float, size: \"screen\")}, \
                 passes: [Screen(name: \"fill\", shader: \"fill.wgsl\")], outputs: {\"color\": \"color\"})";
    fs::write(at("fill.ron"), graph).unwrap();
    let plane = repository("scenes/lambert_plane.glb").display().to_string();
    let render = |more: &[&str]| {
        let graph = at("fill.ron");
        let out = at("a.exr");
        let args = [&["render", &graph, "--scene", &plane, "--size", "4x2", "--out", &out][..], more].concat();
        let output = crate::command::lightgraph(&args, true);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let told = "`color` holds 6 pixel(s) with a NaN or an infinity, the first at (1, 0)";
    let (code, text) = render(&[]);
    assert!(code == Some(0) && text.contains(&format!("warning: {told}")), "{code:?}: {text}");
    let (code, text) = render(&["--strict"]);
    assert!(code == Some(1) && text.contains(&format!("error: {told}")), "{code:?}: {text}");
    assert!(Path::new(&at("a.exr")).exists(), "the image is there to be looked at");
    let (code, text) = render(&["--strict", "--set", "red=0.5"]);
    assert!(code == Some(0) && !text.contains("holds"), "{code:?}: {text}");
}

/// With an adapter: a shader as deep as the limits allow goes through the driver too.
#[test]
fn the_deepest_shader_that_is_let_pass_reaches_the_device() {
    let scratch = project("hostile-deepest", "", "");
    let at = |name: &str| scratch.path().join(name).display().to_string();
    let chain: String = (0..240).map(|i| format!("else if at.x == {i}.0 {{ x = {i}.0; }} ")).collect();
    let shader = format!(
        "struct Image {{ @location(0) color: vec4f }}\n@fragment fn fragment(@builtin(position) at: vec4f) -> Image {{\n\
         var x = at.x{};\nif x < 0.0 {{ x = 1.0; }} {chain}\nreturn Image(vec4f(x)); }}",
        "+at.y".repeat(480)
    );
    fs::write(at("shaders/deep.wgsl"), shader).unwrap();
    let graph = "Graph(about: \"a\", resources: {\"color\": Texture(format: Rgba32Float, size: \"screen\")}, \
                 passes: [Screen(name: \"fill\", shader: \"deep.wgsl\")], outputs: {\"color\": \"color\"})";
    fs::write(at("deep.ron"), graph).unwrap();
    let plane = repository("scenes/lambert_plane.glb").display().to_string();
    let output = crate::command::lightgraph(
        &["render", &at("deep.ron"), "--scene", &plane, "--size", "4x2", "--out", &at("a.exr")],
        true,
    );
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A glTF of one triangle, whose buffer is [`BUFFER`].
fn triangle() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"uri": BUFFER, "byteLength": 112}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 12},
            {"buffer": 0, "byteOffset": 48, "byteLength": 64},
        ],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    })
}

const BUFFER: &str = "triangle.bin";

/// An accessor of as many zeros as one likes.
fn zeros(count: usize, shape: &str) -> Value {
    let sparse = json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5125}, "values": {"bufferView": 2}});
    json!({"componentType": 5126, "count": count, "type": shape, "sparse": sparse})
}

/// Plans a graph for a scene of [`triangle`]'s kind, besides which there may be a file.
#[track_caller]
fn plan_for(name: &str, gltf: &Value, besides: Option<(&str, Vec<u8>)>, code: i32, words: &[&str]) {
    let scratch = project(name, "", "");
    let floats = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes);
    let indices = [0_u32, 1, 2].map(u32::to_le_bytes);
    let all = [floats.as_flattened(), indices.as_flattened(), &[0; 64]].concat();
    fs::write(scratch.path().join(BUFFER), all).unwrap();
    if let Some((file, bytes)) = besides {
        fs::write(scratch.path().join(file), bytes).unwrap();
    }
    fs::write(scratch.path().join("s.gltf"), gltf.to_string()).unwrap();
    expect(scratch.path(), &["plan", "g.ron", "--scene", "s.gltf"], code, words);
}

#[test]
fn instances_of_all_nodes_together_have_a_limit() {
    let mut gltf = triangle();
    gltf["accessors"].as_array_mut().unwrap().push(zeros(1 << 18, "VEC3"));
    let many = json!({"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}});
    gltf["nodes"].as_array_mut().unwrap().extend(vec![many; 64]);
    gltf["scenes"][0]["nodes"] = (0..65).collect();
    let words = ["nodes[2]", "262144 instances, 524288 over all nodes; at most 262144 fit"];
    plan_for("hostile-instances", &gltf, None, 1, &words);
}

#[test]
fn an_instance_costs_what_it_shows_and_not_what_its_mesh_could() {
    let mut gltf = triangle();
    let mut positions = zeros(6_000_000, "VEC3");
    positions["sparse"] =
        json!({"count": 3, "indices": {"bufferView": 1, "componentType": 5125}, "values": {"bufferView": 0}});
    let indices = json!({"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"});
    gltf["accessors"] = json!([positions, indices, zeros(1 << 17, "VEC3")]);
    gltf["meshes"][0]["primitives"][0]["indices"] = json!(1);
    gltf["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(0);
    let places = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}});
    gltf["nodes"] = json!([{"mesh": 0, "extensions": places}]);
    plan_for("hostile-vertices", &gltf, None, 0, &[]);
}

/// [`triangle`] with one sampler that moves these nodes, and the file of its times.
fn moved(keys: u32, nodes: impl Iterator<Item = usize>) -> (Value, Vec<u8>) {
    let times: Vec<u8> = (0..keys).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let mut gltf = triangle();
    gltf["buffers"].as_array_mut().unwrap().push(json!({"uri": "times.bin", "byteLength": times.len()}));
    gltf["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 1, "byteLength": times.len()}));
    let input = json!({"bufferView": 3, "componentType": 5126, "count": keys, "type": "SCALAR"});
    gltf["accessors"].as_array_mut().unwrap().extend([input, zeros(keys as usize, "VEC3")]);
    let channel = |node: usize| json!({"sampler": 0, "target": {"node": node, "path": "translation"}});
    let channels: Vec<Value> = nodes.map(channel).collect();
    gltf["animations"] = json!([{"samplers": [{"input": 1, "output": 2}], "channels": channels}]);
    (gltf, times)
}

#[test]
fn channels_with_the_same_keys_take_neither_memory_nor_time() {
    let channels = 10_000;
    let plan = |name: &str, node: fn(usize) -> usize| {
        let (mut gltf, times) = moved(100_000, (0..channels).map(node));
        gltf["nodes"].as_array_mut().unwrap().extend(vec![json!({}); channels]);
        gltf["scenes"][0]["nodes"] = (0..=channels).collect();
        plan_for(name, &gltf, Some(("times.bin", times)), 0, &[]);
    };
    plan("hostile-channel", |_| 0);
    plan("hostile-channels", |i| i + 1);
}

#[test]
fn what_hangs_from_many_moving_nodes_is_not_swept_by_each_alone() {
    let nodes = 1000;
    let (mut gltf, times) = moved(256, 0..nodes);
    let below = |i: usize| if i + 1 < nodes { json!({"mesh": 0, "children": [i + 1]}) } else { json!({"mesh": 0}) };
    gltf["nodes"] = (0..nodes).map(below).collect();
    plan_for("hostile-chain", &gltf, Some(("times.bin", times)), 0, &[]);
}

#[test]
fn thousands_of_cameras_may_have_one_name() {
    let mut gltf = triangle();
    gltf["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}]);
    gltf["nodes"].as_array_mut().unwrap().extend(vec![json!({"name": "a", "camera": 0}); 6000]);
    gltf["scenes"][0]["nodes"] = (0..=6000).collect();
    plan_for("hostile-cameras", &gltf, None, 0, &[]);
}

#[test]
fn a_file_is_read_once_however_many_buffers_name_it() {
    let mut gltf = triangle();
    gltf["buffers"].as_array_mut().unwrap().extend(vec![json!({"uri": "large.bin", "byteLength": 1}); 2000]);
    plan_for("hostile-buffers", &gltf, Some(("large.bin", vec![0; 4 << 20])), 0, &[]);
}

#[test]
fn primitives_that_share_an_accessor_are_counted_before_they_are_read() {
    let mut gltf = triangle();
    gltf["accessors"].as_array_mut().unwrap().extend([
        zeros(2_000_000, "VEC3"),
        json!({"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"}),
    ]);
    gltf["images"] = json!([{"uri": "none.png"}]);
    gltf["textures"] = json!([{"source": 0}]);
    gltf["materials"] = json!([{"normalTexture": {"index": 0}}]);
    let strip = json!({"attributes": {"POSITION": 1}, "mode": 5, "material": 0});
    gltf["meshes"][0]["primitives"] = json!(vec![strip; 3000]);
    let words = ["5999994000 triangles over all nodes; at most 16777216 fit"];
    plan_for("hostile-triangles", &gltf, None, 1, &words);
    let few = json!({"attributes": {"POSITION": 1}, "indices": 2});
    gltf["meshes"][0]["primitives"] = json!(vec![few; 3000]);
    let words = ["6000009000 vectors and indices over all primitives; at most 536870912 fit"];
    plan_for("hostile-elements", &gltf, None, 1, &words);
}

#[test]
fn sizes_that_follow_from_each_other_have_a_limit() {
    let scratch = Scratch::new("chain");
    let size = |i: u32| if i == 1998 { "screen".to_string() } else { format!("t{}", i + 1) };
    let one = |i: u32| format!("\"t{i}\": Texture(format: Rgba16Float, size: \"{}\"),\n", size(i));
    let all: String = (0..1999).map(one).collect();
    let text = format!(
        "Graph(about: \"A chain.\", resources: {{{all}}}, passes: [Clear(name: \"c\", target: \"t0\", \
         value: (0, 0, 0, 0))], outputs: {{\"t0\": \"t0\"}})"
    );
    fs::write(scratch.path().join("chain.ron"), text).unwrap();
    // Tests are planned on threads, whose stacks are small.
    fs::create_dir_all(scratch.path().join("tests/graphs")).unwrap();
    let test = "Test(about: \"t\", graph: \"../../chain.ron\", size: (8, 8), checks: [Plan()])";
    fs::write(scratch.path().join("tests/graphs/chain.ron"), test).unwrap();
    expect(scratch.path(), &["check", "chain.ron"], 1, &["more than 200 sizes follow from each other"]);
    expect(scratch.path(), &["plan", "chain.ron"], 1, &["more than 200 sizes follow from each other"]);
}

#[test]
fn fields_and_names_without_number_are_told_apart_in_time() {
    let scratch = Scratch::new("fields");
    let text = format!("Graph({} about: \"Many.\")", "about: \"\",".repeat(200_000));
    fs::write(scratch.path().join("fields.ron"), text).unwrap();
    expect(scratch.path(), &["check", "fields.ron"], 1, &["`about` stands twice"]);
    let name = |i: u32| format!("\"m{i}\":(),");
    let text = format!("Scene(gltf: \"s.gltf\", materials: {{{}}})", (0..150_000).map(name).collect::<String>());
    fs::write(scratch.path().join("many.ron"), text).unwrap();
    fs::copy(repository("scenes/cornell_point.gltf"), scratch.path().join("s.gltf")).unwrap();
    fs::write(scratch.path().join("g.ron"), graph("a.wgsl")).unwrap();
    expect(scratch.path(), &["plan", "g.ron", "--scene", "many.ron"], 1, &["no material called \"m0\""]);
}
