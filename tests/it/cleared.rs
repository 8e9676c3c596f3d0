//! Buffers cleared to a number: it is of the type that shaders bind the buffer as.

use crate::{device, support};
use lightgraph::internals::diag::Source;
use lightgraph::internals::graph;
use lightgraph::internals::shader::Library;
use lightgraph::{Checked, Project, Scene, Session, Settings};
use std::path::Path;
use std::sync::Arc;

/// The sixth number that a shader reads, as bits, of a buffer that holds `element`s.
fn read(element: &str, resource: &str, clear: &str) -> Checked<u32> {
    let text = format!(
        "Graph(resources: {{
            \"cells\": Buffer(stride: {}, count: 8, {resource}),
            \"image\": Texture(format: R32Float, size: 8),
         }},
         passes: [{clear} Compute(name: \"show\", shader: \"show.wgsl\", over: \"image\")],
         outputs: {{\"image\": \"image\"}})",
        if element == "Mixed" { 8 } else { 4 },
    );
    let shader = format!(
        "struct Mixed {{ a: u32, b: f32 }}
         var<storage, read_write> cells: array<{element}>;
         var image: texture_storage_2d<r32float, write>;
         @compute @workgroup_size(8) fn show(@builtin(global_invocation_id) id: vec3u) {{
             textureStore(image, id.xy, vec4f({}));
         }}",
        match element {
            "atomic<u32>" => "bitcast<f32>(atomicLoad(&cells[id.x]))",
            "Mixed" => "bitcast<f32>(cells[id.x / 2u].a)",
            _ => "bitcast<f32>(cells[id.x])",
        }
    );
    let source = Source::new("cleared.ron", text);
    let files = |_: &Path| -> Checked<Arc<Source>> { Ok(source.clone()) };
    let graph = graph::load(Path::new("cleared.ron"), &files)?;
    let files = [("show.wgsl".to_string(), Source::new("show.wgsl", shader))].into_iter().collect();
    let project = Project { graph, texts: Library { files, ..Library::default() } };
    let gpu = device::gpu();
    let scene = Scene::load(&support::repository("scenes/cornell_point.gltf"))?.scene;
    let settings = Settings { size: [8, 8], skip: true, verify: true, ..Settings::default() };
    let mut session = Session::new(&gpu, &project, scene, settings)?;
    session.frame(&gpu, 0, 0.0)?;
    Ok(session.image(&gpu, "image")?.data[5].to_bits())
}

fn cleared(element: &str, value: &str) -> Checked<u32> {
    read(element, "", &format!("Clear(name: \"clear\", target: \"cells\", value: {value}),"))
}

#[test]
fn a_buffer_is_cleared_in_the_type_of_its_numbers() {
    let bits = |found: Checked<u32>| found.unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(bits(cleared("u32", "70000")), 70_000);
    assert_eq!(bits(cleared("atomic<u32>", "1234567")), 1_234_567);
    assert_eq!(bits(cleared("i32", "-3")), (-3_i32) as u32);
    assert_eq!(bits(cleared("f32", "0.75")), 0.75_f32.to_bits());
    assert_eq!(bits(read("u32", "history: true, initial: 12", "")), 12);
    assert_eq!(bits(read("u32", "initial: 13", "")), 13);
}

#[test]
fn a_value_that_is_no_number_of_the_type_is_a_fault() {
    let told = |found: Checked<u32>| found.unwrap_err().to_string();
    let half = told(cleared("u32", "0.5"));
    assert!(half.contains("`cells` can't be cleared to 0.5: shaders bind it as u32"), "{half}");
    assert!(half.contains("cleared.ron:2"), "{half}");
    assert!(told(cleared("i32", "3000000000")).contains("bind it as i32"));
    assert!(told(cleared("Mixed", "1")).contains("bind it as u32 and f32"));
}
