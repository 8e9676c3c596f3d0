//! What a probe sees through one face of its cube, packed: as capture.wgsl has it.
#import lightgraph::geometry::{world_position, world_normal}
#import lightgraph::cube::clip
#import lightgraph::packed_surface::pack
#import lightgraph::probes
#import lightgraph::surface::record

struct Box {
    bounds_min: vec3f,
    bounds_max: vec3f,
    grid_min: vec3f,
    grid_max: vec3f,
}
var<uniform> box: Box;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) node: u32,
    @location(4) material: u32,
}

struct Varying {
    @builtin(position) at: vec4f,
    /// From the probe, metres.
    @location(0) offset: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) @interpolate(flat) material: u32,
}

@vertex
fn vertex(in: Vertex, @builtin(instance_index) member: u32) -> Varying {
    let probe = probes::position(probes::coordinates(member / 6u));
    let offset = world_position(in.node, in.position) - probe;
    // From any probe the whole scene lies within the diagonal of the box round scene and probes.
    let far = distance(min(box.bounds_min, box.grid_min), max(box.bounds_max, box.grid_max)) * 1.01;
    var out: Varying;
    out.at = clip(offset, member % 6u, far * 0.001, far);
    out.offset = offset;
    out.normal = world_normal(in.node, in.normal);
    out.uv = in.uv;
    out.material = in.material;
    return out;
}

struct Captured {
    @location(0) cube_surface: vec4u,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
    // A cube's face is a mirror image, which turns every triangle round.
    let r = record(in.material, in.uv, in.normal, length(in.offset), !mirrored_front);
    return Captured(pack(r));
}
