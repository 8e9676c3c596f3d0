//! The texels of a shadow map, found where they are asked for instead of drawn beforehand: for scenes of few triangles that are
//! looked up less often than a map has texels.
//!
//! A texel is nearer to the light than a point on its ray where the point lies in a triangle's shadow volume (Crow, "Shadow
//! Algorithms for Computer Graphics", 1977): behind the triangle, and inside of three planes through the light and an edge.
//! The SHADOW_TRIANGLES volumes of a light follow on those of the light before it.
#define_import_path lightgraph::shadow_volumes

struct Volume {
    plane: vec4f,
    /// Along the edges.
    a: vec4f,
    b: vec4f,
    c: vec4f,
}
var<uniform> shadow_volumes: array<Volume, #{VOLUME_COUNT}>;

/// A copy of one's own: CPU drivers fetch from it many times as fast.
var<private> volumes: array<Volume, #{VOLUME_COUNT}>;

/// Comes before all that is asked for below.
fn fetch() {
    for (var i = 0u; i < #{VOLUME_COUNT}u; i++) {
        volumes[i] = shadow_volumes[i];
    }
}

/// Four points at the corners of a rectangle.
struct Points {
    /// The first, and 1.
    first: vec4f,
    /// To the second and the fourth.
    right: vec3f,
    /// To the third and the fourth.
    down: vec3f,
}

/// Of each point the distance to a plane.
fn heights(plane: vec4f, p: Points) -> vec4f {
    let first = dot(plane, p.first);
    let right = dot(plane.xyz, p.right);
    let down = first + dot(plane.xyz, p.down);
    return vec4f(first, first + right, down, down + right);
}

/// Of each point a number below 0 inside of a volume. Signs are joined as bits: the least of floats takes three times as long.
fn inside(i: u32, p: Points) -> vec4i {
    let plane = bitcast<vec4i>(heights(volumes[i].plane, p));
    let a = bitcast<vec4i>(heights(volumes[i].a, p));
    let b = bitcast<vec4i>(heights(volumes[i].b, p));
    let c = bitcast<vec4i>(heights(volumes[i].c, p));
    return plane & a & b & c;
}

/// The same for any of four. Written out, as below: places that are known beforehand need no look-up.
fn inside_four(i: u32, p: Points) -> vec4i {
    return inside(i, p) | inside(i + 1u, p) | inside(i + 2u, p) | inside(i + 3u, p);
}

fn inside_sixteen(i: u32, p: Points) -> vec4i {
    return inside_four(i, p) | inside_four(i + 4u, p) | inside_four(i + 8u, p) | inside_four(i + 12u, p);
}

/// Of each point whether light number `light` reaches it.
fn reached(light: u32, p: Points) -> vec4<bool> {
    let first = light * #{SHADOW_TRIANGLES}u;
    var any = inside_sixteen(first, p);
#if SHADOW_TRIANGLES > 16
    any |= inside_sixteen(first + 16u, p);
#endif
#if SHADOW_TRIANGLES > 32
    any |= inside_sixteen(first + 32u, p);
#endif
#if SHADOW_TRIANGLES > 48
    any |= inside_sixteen(first + 48u, p);
#endif
    return any >= vec4i(0);
}
