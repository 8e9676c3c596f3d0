//! What a probe sees through one face of its cube: where vertices fall, and what is recorded of a surface (section 3.1
//! of the paper).
#define_import_path lightgraph::face
#import lightgraph::geometry::{world_position, world_normal}
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::probe_views::depths
#import lightgraph::surface::{Point, Record, record}
#ifdef NORMAL_MAPS
#import lightgraph::geometry::world_tangent
#endif
#ifdef MORE_AT_VERTICES
#import lightgraph::vertices::vertices
#endif

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
#ifdef SECOND_UVS
    @location(5) second_uv: vec2f,
#endif
#ifdef VERTEX_COLORS
    @location(6) color: vec4f,
#endif
#ifdef NORMAL_MAPS
    @location(7) tangent: vec4f,
#endif
}

struct Params {
    /// Texels along a face.
    face: u32,
}
var<uniform> faces: Params;

/// A vertex, number `index` of all, seen from a probe through a face.
fn seen(in: Vertex, index: u32, number: u32, face: u32) -> Varying {
    let probe = probes::position(probes::coordinates(number));
    let offset = world_position(in.node, in.position) - probe;
    let d = depths();
    var out: Varying;
    out.at = cube::clip(offset, face, faces.face, d.x, d.y);
    out.offset = offset;
    out.normal = world_normal(in.node, in.normal);
    out.uv = in.uv;
    out.material = in.material;
    out.face = face;
#ifdef SECOND_UVS
    out.second_uv = vertices[index].second_uv;
#endif
#ifdef VERTEX_COLORS
    out.color = vertices[index].color;
#endif
#ifdef NORMAL_MAPS
    out.tangent = world_tangent(in.node, vertices[index].tangent);
#endif
    return out;
}

/// A cube's face is a mirror image, which turns every triangle round.
fn recorded(in: Varying, mirrored_front: bool) -> Record {
    let plane = cube::plane(in.face, in.offset, cube::slope(in.at, faces.face));
    let ray = cube::direction_beside(in.face, vec2u(in.at.xy) % faces.face, faces.face);
    let distance = cube::along(ray, in.offset, plane);
    var p: Point;
    p.uv = in.uv;
#ifdef SECOND_UVS
    p.second_uv = in.second_uv;
#endif
#ifdef VERTEX_COLORS
    p.color = in.color;
#endif
#ifdef NORMAL_MAPS
    p.tangent = in.tangent;
#endif
    return record(in.material, p, in.normal, distance, !mirrored_front);
}
