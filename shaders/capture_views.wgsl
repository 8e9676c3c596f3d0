//! What a probe sees through the six faces of its cube at once, a view each: as capture.wgsl has it.
#import lightgraph::face::{Varying, Vertex, recorded, seen}

/// The loop's index.
var<uniform> probe: u32;

@vertex
fn vertex(in: Vertex, @builtin(vertex_index) index: u32, @builtin(view_index) face: u32) -> Varying {
    return seen(in, index, probe, face);
}

struct Captured {
    @location(0) face_albedo: vec4f,
    @location(1) face_normal: vec4f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
    let r = recorded(in, mirrored_front);
    return Captured(r.albedo, r.normal);
}
