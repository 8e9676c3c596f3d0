//! What a probe sees through one face of its cube: where vertices fall, and what is recorded of a surface (section 3.1 of
//! the paper).
#define_import_path lightgraph::face
#import lightgraph::geometry::{world_position, world_normal}
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::probe_views::depths
#import lightgraph::surface::{Record, record}

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
    @location(4) @interpolate(flat) face: u32,
}

struct Params {
    /// Texels along a face.
    face: u32,
}
var<uniform> faces: Params;

/// A vertex seen from probe number `index` through a face.
fn seen(in: Vertex, index: u32, face: u32) -> Varying {
    let probe = probes::position(probes::coordinates(index));
    let offset = world_position(in.node, in.position) - probe;
    let d = depths();
    var out: Varying;
    out.at = cube::clip(offset, face, faces.face, d.x, d.y);
    out.offset = offset;
    out.normal = world_normal(in.node, in.normal);
    out.uv = in.uv;
    out.material = in.material;
    out.face = face;
    return out;
}

/// A cube's face is a mirror image, which turns every triangle round.
fn recorded(in: Varying, mirrored_front: bool) -> Record {
    let plane = cube::plane(in.face, in.offset, cube::slope(in.at, faces.face));
    let ray = cube::direction_beside(in.face, vec2u(in.at.xy) % faces.face, faces.face);
    let distance = cube::along(ray, in.offset, plane);
    return record(in.material, in.uv, in.normal, distance, !mirrored_front);
}
