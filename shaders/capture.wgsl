//! What a probe sees through one face of its cube: albedo, normal, distance (section 3.1 of the paper). With
//! PACKED_CAPTURE in one texel instead of two.
#import lightgraph::face::{Varying, Vertex, recorded, seen}
#ifdef PACKED_CAPTURE
#import lightgraph::packed_surface::pack
#endif

@vertex
fn vertex(in: Vertex, @builtin(vertex_index) index: u32, @builtin(instance_index) member: u32) -> Varying {
    return seen(in, index, member / 6u, member % 6u);
}

struct Captured {
#ifdef PACKED_CAPTURE
    @location(0) cube_surface: vec4u,
#else
    @location(0) cube_albedo: vec4f,
    @location(1) cube_normal: vec4f,
#endif
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
    let r = recorded(in, mirrored_front);
#ifdef PACKED_CAPTURE
    return Captured(pack(r));
#else
    return Captured(r.albedo, r.normal);
#endif
}
