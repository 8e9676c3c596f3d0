//! How far a probe sees through one face of its cube, and the plane there: metres along the ray, negative where it sees
//! the back of a single-sided surface, as a probe inside a solid does, 0 for nothing; then the triangle's unit normal,
//! on the side away from the probe.
#import lightgraph::geometry::world_position
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::probe_views::depths
#import lightgraph::surface::materials
#ifdef MASKS
#import lightgraph::holes::{Cut, cut_at, end_in_hole}
#endif

struct Params {
    distance_face: u32,
}
var<uniform> params: Params;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) node: u32,
    @location(2) material: u32,
#ifdef MASKS
    @location(3) uv: vec2f,
#endif
}

struct Varying {
    @builtin(position) at: vec4f,
    /// From the probe, metres.
    @location(0) offset: vec3f,
    @location(1) @interpolate(flat) material: u32,
    @location(2) @interpolate(flat) face: u32,
#ifdef MASKS
    @location(3) uv: vec2f,
    @location(4) second_uv: vec2f,
    @location(5) alpha: f32,
#endif
}

@vertex
fn vertex(in: Vertex, @builtin(vertex_index) index: u32, @builtin(instance_index) member: u32) -> Varying {
    let probe = probes::position(probes::coordinates(member / 6u));
    let offset = world_position(in.node, in.position) - probe;
    let d = depths();
    let face = member % 6u;
    var out: Varying;
    out.at = cube::clip(offset, face, params.distance_face, d.x, d.y);
    out.offset = offset;
    out.material = in.material;
    out.face = face;
#ifdef MASKS
    let cut = cut_at(index, in.uv);
    out.uv = cut.uv;
    out.second_uv = cut.second_uv;
    out.alpha = cut.alpha;
#endif
    return out;
}

struct Captured {
    @location(0) probe_distance: vec4f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
#ifdef MASKS
    end_in_hole(in.material, Cut(in.uv, in.second_uv, in.alpha));
#endif
    let edge = params.distance_face;
    let plane = cube::plane(in.face, in.offset, cube::slope(in.at, edge));
    let distance = cube::along(cube::direction_beside(in.face, vec2u(in.at.xy) % edge, edge), in.offset, plane);
    // A cube's face is a mirror image, which turns every triangle round.
    let solid = mirrored_front && materials[in.material].double_sided == 0u;
    return Captured(vec4f(select(1.0, -1.0, solid) * distance, plane));
}
