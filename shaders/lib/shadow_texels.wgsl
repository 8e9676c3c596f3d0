//! Shadow maps in a table, made by kernels.
#define_import_path lightgraph::shadow_texels
#import lightgraph::raster::{Corners, corners}

struct LightView {
    /// Row of `lights`.
    light: u32,
    view_projection: mat4x4f,
    /// Corners of the box round everything.
    lower: vec3f,
    upper: vec3f,
}
var<storage, read> light_views: array<LightView>;

struct Triangle {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}
var<storage, read> triangles: array<Triangle>;

struct Params {
    shadow_size: u32,
    triangles: u32,
}
var<uniform> params: Params;

/// Triangles that follow on each other and have a box together.
const GROUP: u32 = 128u;

/// Texels of a view that a triangle, or a group of them, may cover: the first, and those past the last, x in the lower
/// half.
struct Covered {
    first: u32,
    end: u32,
}

/// A triangle as a view shows it; `place`: the texel that others count from.
fn seen(triangle: u32, view: u32, place: vec2u) -> Corners {
    let t = triangles[triangle];
    return corners(light_views[view].view_projection, mat3x3f(t.a, t.b, t.c), params.shadow_size, vec2f(place));
}
