//! Writes what follows from where nodes are to the rows of a table: their matrices, or positions, normals and tangents
//! of triangles in world space.

/// The number of words in a row. Then nine places in it: of a node's transform, the matrix for its normals and its
/// transform in the frame before; or of three positions, three normals and three tangents. Then each range of rows: its
/// first, and how many.
@group(0) @binding(0) var<storage, read> job: array<u32>;
struct Nodes {
    /// The first of those of now.
    now: u32,
    /// The first of those of the frame before.
    before: u32,
    transforms: array<mat4x4f>,
}
@group(0) @binding(1) var<storage, read> nodes: Nodes;
@group(0) @binding(2) var<storage, read_write> rows: array<u32>;
/// Ten words a vertex: position, normal, texture coordinates, row of `nodes`, material.
@group(0) @binding(3) var<storage, read> vertices: array<u32>;
/// By vertex; a single one where the scene has none.
@group(0) @binding(4) var<storage, read> tangents: array<vec4f>;
/// Three vertices a row.
@group(0) @binding(5) var<storage, read> corners: array<u32>;

const TRANSFORM: u32 = 1u;
const INVERSE_TRANSPOSE: u32 = 2u;
const PREVIOUS_TRANSFORM: u32 = 3u;

const POSITIONS: u32 = 1u;
const NORMALS: u32 = 4u;
const TANGENTS: u32 = 7u;
const RANGES: u32 = 10u;
/// The row has no such member.
const ABSENT: u32 = 0xffffffffu;

fn three(at: u32) -> vec3f {
    return bitcast<vec3f>(vec3u(vertices[at], vertices[at + 1u], vertices[at + 2u]));
}

fn put(at: u32, value: vec3f) {
    let words = bitcast<vec3u>(value);
    rows[at] = words.x;
    rows[at + 1u] = words.y;
    rows[at + 2u] = words.z;
}

/// Sums in the host's order.
fn turned(m: mat3x3f, v: vec3f) -> vec3f {
    return m[0] * v.x + m[1] * v.y + m[2] * v.z;
}

fn finite(v: vec3f) -> bool {
    return all((bitcast<vec3u>(v) & vec3u(0x7f800000u)) != vec3u(0x7f800000u));
}

/// What turns normals: the inverse transpose, or the matrix of cofactors where there is none.
fn for_normals(m: mat3x3f) -> mat3x3f {
    let cofactors = mat3x3f(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    let share = 1.0 / dot(m[2], cofactors[2]);
    let inverse = mat3x3f(cofactors[0] * share, cofactors[1] * share, cofactors[2] * share);
    if finite(inverse[0]) && finite(inverse[1]) && finite(inverse[2]) {
        return inverse;
    }
    if finite(cofactors[0]) && finite(cofactors[1]) && finite(cofactors[2]) {
        return cofactors;
    }
    return mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
}

/// Scales to unit length; returns `without` for a vector that has no direction.
fn unit(v: vec3f, without: vec3f) -> vec3f {
    let squared = v.x * v.x + v.y * v.y + v.z * v.z;
    if squared > 0.0 && squared <= 3.4028234e38 {
        return v * (1.0 / sqrt(squared));
    }
    return without;
}

@compute @workgroup_size(64)
fn write_matrices(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let range = RANGES + 2u * id.y;
    for (var i = id.x; i < job[range + 1u]; i += 64u * groups.x) {
        let row = job[range] + i;
        let m = nodes.transforms[nodes.now + row];
        let turn = for_normals(mat3x3f(m[0].xyz, m[1].xyz, m[2].xyz));
        let last = vec4f(0.0, 0.0, 0.0, 1.0);
        let normals = mat4x4f(vec4f(turn[0], 0.0), vec4f(turn[1], 0.0), vec4f(turn[2], 0.0), last);
        put_matrix(row, TRANSFORM, m);
        put_matrix(row, INVERSE_TRANSPOSE, normals);
        put_matrix(row, PREVIOUS_TRANSFORM, nodes.transforms[nodes.before + row]);
    }
}

fn put_matrix(row: u32, member: u32, m: mat4x4f) {
    if job[member] == ABSENT {
        return;
    }
    let at = row * job[0] + job[member];
    for (var column = 0u; column < 4u; column++) {
        let words = bitcast<vec4u>(m[column]);
        for (var i = 0u; i < 4u; i++) {
            rows[at + 4u * column + i] = words[i];
        }
    }
}

@compute @workgroup_size(64)
fn write_triangles(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let range = RANGES + 2u * id.y;
    for (var i = id.x; i < job[range + 1u]; i += 64u * groups.x) {
        write_triangle(job[range] + i);
    }
}

fn write_triangle(row: u32) {
    let start = row * job[0];
    for (var corner = 0u; corner < 3u; corner++) {
        let vertex = corners[3u * row + corner];
        let first = 10u * vertex;
        let m = nodes.transforms[nodes.now + vertices[first + 8u]];
        let part = mat3x3f(m[0].xyz, m[1].xyz, m[2].xyz);
        if job[POSITIONS + corner] != ABSENT {
            put(start + job[POSITIONS + corner], turned(part, three(first)) + m[3].xyz);
        }
        if job[NORMALS + corner] != ABSENT {
            let normal = turned(for_normals(part), three(first + 3u));
            put(start + job[NORMALS + corner], unit(normal, vec3f(0.0, 1.0, 0.0)));
        }
        if job[TANGENTS + corner] != ABSENT {
            let tangent = tangents[min(vertex, arrayLength(&tangents) - 1u)];
            let at = start + job[TANGENTS + corner];
            put(at, unit(turned(part, tangent.xyz), vec3f(1.0, 0.0, 0.0)));
            // A mirroring transform flips the bitangent.
            rows[at + 3u] = bitcast<u32>(select(tangent.w, -tangent.w, dot(cross(m[0].xyz, m[1].xyz), m[2].xyz) < 0.0));
        }
    }
}
