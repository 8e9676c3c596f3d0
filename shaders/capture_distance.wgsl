//! How far a probe sees through one face of its cube, and the plane there: metres along the ray, negative where it sees
//! the back of a single-sided surface, as a probe inside a solid does, 0 for nothing; then the triangle's unit normal,
//! on the side away from the probe.
#import lightgraph::geometry::world_position
#import lightgraph::cube
#import lightgraph::probes
#import lightgraph::probe_views::depths
#import lightgraph::surface::materials

struct Params {
    distance_face: u32,
}
var<uniform> params: Params;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) node: u32,
    @location(2) material: u32,
}

struct Varying {
    @builtin(position) at: vec4f,
    /// From the probe, metres.
    @location(0) offset: vec3f,
    @location(1) @interpolate(flat) material: u32,
    @location(2) @interpolate(flat) face: u32,
}

@vertex
fn vertex(in: Vertex, @builtin(instance_index) member: u32) -> Varying {
    let probe = probes::position(probes::coordinates(member / 6u));
    let offset = world_position(in.node, in.position) - probe;
    let d = depths();
    let face = member % 6u;
    return Varying(cube::clip(offset, face, params.distance_face, d.x, d.y), offset, in.material, face);
}

struct Captured {
    @location(0) probe_distance: vec4f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
    let edge = params.distance_face;
    let plane = cube::plane(in.face, in.offset, cube::slope(in.at, edge));
    let distance = cube::along(cube::direction_beside(in.face, vec2u(in.at.xy) % edge, edge), in.offset, plane);
    // A cube's face is a mirror image, which turns every triangle round.
    let solid = mirrored_front && materials[in.material].double_sided == 0u;
    return Captured(vec4f(select(1.0, -1.0, solid) * distance, plane));
}
