//! A grid of probes that follows the camera, a step of whole cells at a time.
//!
//! Its probes stand at whole multiples of `spacing`, so that a step leaves all but one slab where they are: each keeps
//! its place in a ring along every axis, and the slab that is left behind is used again in front (Losasso and Hoppe,
//! "Geometry Clipmaps", 2004). A point's share in it goes by the camera itself, not by the grid, and has vanished
//! before the grid ends: whenever a slab comes or goes, nothing is taken from it.
#define_import_path lightgraph::probe_view

struct View {
    /// Probes along x, y, z.
    fine: vec3u,
    /// Distance between probes, metres.
    spacing: f32,
    /// Width of the zone over which the share goes from 1 to 0, in distances between probes.
    fade: f32,
}
var<uniform> view: View;

/// Number of a place among `counts` along the axes: x fastest, then y, then z.
fn pack(at: vec3u, counts: vec3u) -> u32 {
    return (at.z * counts.y + at.y) * counts.x + at.x;
}

/// The inverse of `pack`.
fn unpack(number: u32, counts: vec3u) -> vec3u {
    return vec3u(number % counts.x, number / counts.x % counts.y, number / (counts.x * counts.y));
}

/// In distances between probes: how far the grid reaches from its middle, whatever the step.
fn radius() -> vec3f {
    return max(vec3f(view.fine / 2u) - 1.0, vec3f(0.0));
}

/// Where the grid is in this frame, in distances between probes.
struct Stand {
    /// The middle that points take their shares by; it goes with the camera.
    middle: vec3f,
    /// The probe with the least coordinates; it goes in whole steps.
    first: vec3i,
}
var<storage, read> view_stand: Stand;

/// Place in the ring of a probe at a whole multiple of the spacing.
fn ring_place(lattice: vec3i) -> vec3u {
    let n = vec3i(view.fine);
    return vec3u((lattice % n + n) % n);
}

/// Number of a place in the ring; places past its end begin anew.
fn ring_number(place: vec3u) -> u32 {
    return pack(place % view.fine, view.fine);
}

/// Where the probe with a number in the ring stands, metres.
fn position(number: u32) -> vec3f {
    let low = view_stand.first;
    let ahead = ring_place(vec3i(unpack(number, view.fine)) - low);
    return view.spacing * vec3f(low + vec3i(ahead));
}

/// A point in the world, in distances between probes.
fn lattice_place(point: vec3f) -> vec3f {
    return point / view.spacing;
}

/// How much the grid counts at a point, 0 to 1.
fn share(point: vec3f) -> f32 {
    let inside = (radius() - abs(lattice_place(point) - view_stand.middle)) / view.fade;
    let s = smoothstep(vec3f(0.0), vec3f(1.0), inside);
    return s.x * s.y * s.z;
}
