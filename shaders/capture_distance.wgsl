//! How far a probe sees through one face of its cube: metres along the ray; negative where it sees the back of a
//! single-sided surface, as a probe inside a solid does; 0 for nothing.
#import lightgraph::geometry::world_position
#import lightgraph::cube::clip
#import lightgraph::probes
#import lightgraph::probe_views::depths
#import lightgraph::surface::materials

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
}

@vertex
fn vertex(in: Vertex, @builtin(instance_index) member: u32) -> Varying {
    let probe = probes::position(probes::coordinates(member / 6u));
    let offset = world_position(in.node, in.position) - probe;
    let d = depths();
    return Varying(clip(offset, member % 6u, d.x, d.y), offset, in.material);
}

struct Captured {
    @location(0) probe_distance: vec4f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
    // A cube's face is a mirror image, which turns every triangle round.
    let solid = mirrored_front && materials[in.material].double_sided == 0u;
    return Captured(vec4f(select(1.0, -1.0, solid) * length(in.offset), 0.0, 0.0, 0.0));
}
