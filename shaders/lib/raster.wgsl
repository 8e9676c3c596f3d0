//! Triangles on a square of texels that a view looks through, as a draw covers them: for kernels that draw.
#define_import_path lightgraph::raster

/// The corners of a triangle, a column each: x and y in texels from a place, times w, and w. Homogeneous, so that
/// nothing need be cut where the triangle passes the eye.
struct Corners {
    at: mat3x3f,
    /// In clip space.
    depths: vec3f,
}

/// Of a triangle in the world; `size`: texels along the square.
fn corners(view_projection: mat4x4f, world: mat3x3f, size: u32, place: vec2f) -> Corners {
    let a = view_projection * vec4f(world[0], 1.0);
    let b = view_projection * vec4f(world[1], 1.0);
    let c = view_projection * vec4f(world[2], 1.0);
    let half = 0.5 * f32(size);
    let x = vec3f(half - place.x, half - place.y, 1.0);
    return Corners(
        mat3x3f(
            vec3f(half * a.x, -half * a.y, 0.0) + x * a.w,
            vec3f(half * b.x, -half * b.y, 0.0) + x * b.w,
            vec3f(half * c.x, -half * c.y, 0.0) + x * c.w,
        ),
        vec3f(a.z, b.z, c.z),
    );
}

/// The line through two corners (x and y in texels, times w, and w), where a draw has it: through places on a lattice
/// of 256 steps a texel. One that a near plane at `near` cuts is left as it is. By row with a place `(x, y, 1)`; of two
/// triangles beside it both have the same.
fn edge(one: vec3f, two: vec3f, near: f32) -> vec3f {
    let whole = min(one.z, two.z) >= near;
    return cross(select(one, rounded(one), whole), select(two, rounded(two), whole));
}

fn rounded(corner: vec3f) -> vec3f {
    return vec3f(round(256.0 / corner.z * corner.xy) * (corner.z / 256.0), corner.z);
}

/// Texels that a triangle may cover: the first (xy), and those past the last (zw); corners as seen from texel 0. Zeros
/// where it covers none.
fn bounds(c: Corners, size: u32) -> vec4u {
    let edge = vec2f(f32(size));
    var least = edge;
    var most = vec2f(0.0);
    // Round what of it lies behind the near plane.
    for (var i = 0u; i < 3u; i++) {
        let j = (i + 1u) % 3u;
        let one = c.depths[i];
        let two = c.depths[j];
        if one >= 0.0 {
            least = min(least, c.at[i].xy / c.at[i].z);
            most = max(most, c.at[i].xy / c.at[i].z);
        }
        if (one < 0.0) != (two < 0.0) {
            let cut = mix(c.at[i], c.at[j], one / (one - two));
            least = min(least, cut.xy / cut.z);
            most = max(most, cut.xy / cut.z);
        }
    }
    // Where centres may lie between, a hundredth wider for rounding.
    let first = clamp(ceil(least - 0.51), vec2f(0.0), edge);
    let end = clamp(floor(most + 0.51), vec2f(0.0), edge);
    let beyond = c.depths > vec3f(c.at[0].z, c.at[1].z, c.at[2].z);
    return select(vec4u(vec2u(first), vec2u(end)), vec4u(0u), any(first >= end) || all(beyond));
}

/// What grows evenly along the texels: shares of the corners, and depths. By row with a place `(x, y, 1)`.
struct Planes {
    x: vec4f,
    y: vec4f,
    start: vec4f,
}

fn planes(c: Corners) -> Planes {
    let facing = mat3x3f(cross(c.at[1], c.at[2]), cross(c.at[2], c.at[0]), cross(c.at[0], c.at[1]));
    let shares = transpose(facing) * (1.0 / dot(c.at[0], facing[0]));
    return Planes(
        vec4f(shares[0], dot(shares[0], c.depths)),
        vec4f(shares[1], dot(shares[1], c.depths)),
        vec4f(shares[2], dot(shares[2], c.depths)),
    );
}

/// The least of `before` and the triangle's depth, 0 to 1, where it covers a place.
fn nearer(before: f32, p: Planes, place: vec2f) -> f32 {
    let here = p.x * place.x + p.y * place.y + p.start;
    let covered = all(here >= vec4f(0.0));
    return select(before, min(before, here.w), covered);
}
