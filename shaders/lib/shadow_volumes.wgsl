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

/// How deep each point lies in a volume, metres; below 0 outside.
fn depths(i: u32, p: Points) -> vec4f {
    let plane = heights(volumes[i].plane, p);
    let a = heights(volumes[i].a, p);
    let b = heights(volumes[i].b, p);
    let c = heights(volumes[i].c, p);
    return min(min(plane, a), min(b, c));
}

/// The most of four. Written out, as below: what stands at a place known beforehand is fetched once for many invocations.
fn of_four(i: u32, p: Points) -> vec4f {
    return max(max(depths(i, p), depths(i + 1u, p)), max(depths(i + 2u, p), depths(i + 3u, p)));
}

fn of_sixteen(i: u32, p: Points) -> vec4f {
    return max(max(of_four(i, p), of_four(i + 4u, p)), max(of_four(i + 8u, p), of_four(i + 12u, p)));
}

/// Of each point whether light number `light` reaches it.
fn reached(light: u32, p: Points) -> vec4<bool> {
    let first = light * #{SHADOW_TRIANGLES}u;
    var most = of_sixteen(first, p);
#if SHADOW_TRIANGLES > 16
    most = max(most, of_sixteen(first + 16u, p));
#endif
#if SHADOW_TRIANGLES > 32
    most = max(most, of_sixteen(first + 32u, p));
#endif
#if SHADOW_TRIANGLES > 48
    most = max(most, of_sixteen(first + 48u, p));
#endif
    return most <= vec4f(0.0);
}
