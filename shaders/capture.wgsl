//! What a probe sees through one face of its cube: albedo, normal, distance (section 3.1 of the paper).
#import lightgraph::face::{Varying, Vertex, recorded, seen}

@vertex
fn vertex(in: Vertex, @builtin(instance_index) member: u32) -> Varying {
    return seen(in, member / 6u, member % 6u);
}

struct Captured {
    @location(0) cube_albedo: vec4f,
    @location(1) cube_normal: vec4f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) mirrored_front: bool) -> Captured {
    let r = recorded(in, mirrored_front);
    return Captured(r.albedo, r.normal);
}
