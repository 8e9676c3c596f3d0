//! Fits boxes of a hierarchy round the triangles below them. One workgroup walks the levels from the leaves up.

/// The number of words in a row; the places in it of the lower and of the upper corner.
@group(0) @binding(0) var<storage, read> place: array<u32, 3>;
/// How much wider leaves are than their triangles; the number of levels; where each ends; then by row its number, and
/// of a leaf its first triangle and how many it has, else its first child and 0.
@group(0) @binding(1) var<storage, read> list: array<u32>;
/// Ten words a vertex: position, normal, texture coordinates, row of `nodes`, material.
@group(0) @binding(2) var<storage, read> vertices: array<u32>;
/// Three vertices a triangle.
@group(0) @binding(3) var<storage, read> corners: array<u32>;
struct Nodes {
    /// The first of those of now.
    now: u32,
    transforms: array<mat4x4f>,
}
@group(0) @binding(4) var<storage, read> nodes: Nodes;
@group(0) @binding(5) var<storage, read_write> rows: array<u32>;

const ENDS: u32 = 2u;
const ROWS: u32 = 50u;

struct Box {
    lower: vec3f,
    upper: vec3f,
}

@compute @workgroup_size(256)
fn refit(@builtin(local_invocation_index) lane: u32) {
    var start = 0u;
    for (var level = 0u; level < list[1]; level++) {
        let end = list[ENDS + level];
        for (var i = start + lane; i < end; i += 256u) {
            let at = ROWS + 3u * i;
            put(list[at], fitted(list[at + 1u], list[at + 2u]));
        }
        start = end;
        storageBarrier();
    }
}

fn fitted(first: u32, count: u32) -> Box {
    if count == 0u {
        let one = held(first);
        let other = held(first + 1u);
        return Box(min(one.lower, other.lower), max(one.upper, other.upper));
    }
    var around = Box(vec3f(3.4028234e38), vec3f(-3.4028234e38));
    for (var i = 3u * first; i < 3u * (first + count); i++) {
        let position = placed(corners[i]);
        around.lower = min(around.lower, position);
        around.upper = max(around.upper, position);
    }
    let margin = bitcast<f32>(list[0]);
    return Box(around.lower - margin, around.upper + margin);
}

/// Sums in the host's order.
fn placed(vertex: u32) -> vec3f {
    let at = 10u * vertex;
    let p = vec3f(bitcast<f32>(vertices[at]), bitcast<f32>(vertices[at + 1u]), bitcast<f32>(vertices[at + 2u]));
    let m = nodes.transforms[nodes.now + vertices[at + 8u]];
    return m[0].xyz * p.x + m[1].xyz * p.y + m[2].xyz * p.z + m[3].xyz;
}

fn held(row: u32) -> Box {
    return Box(three(row * place[0] + place[1]), three(row * place[0] + place[2]));
}

fn three(at: u32) -> vec3f {
    return vec3f(bitcast<f32>(rows[at]), bitcast<f32>(rows[at + 1u]), bitcast<f32>(rows[at + 2u]));
}

fn put(row: u32, found: Box) {
    let lower = bitcast<vec3u>(found.lower);
    let upper = bitcast<vec3u>(found.upper);
    for (var axis = 0u; axis < 3u; axis++) {
        rows[row * place[0] + place[1] + axis] = lower[axis];
        rows[row * place[0] + place[2] + axis] = upper[axis];
    }
}
