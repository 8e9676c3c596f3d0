//! Transforms triangles to world space: writes the positions, normals and tangents in their rows of a table.

/// The number of words in a row; the places in it of three positions, three normals and three tangents; then each range
/// of rows: its first, and how many.
@group(0) @binding(0) var<storage, read> job: array<u32>;
/// Ten words a vertex: position, normal, texture coordinates, row of `nodes`, material.
@group(0) @binding(1) var<storage, read> vertices: array<u32>;
/// By vertex; a single one where the scene has none.
@group(0) @binding(2) var<storage, read> tangents: array<vec4f>;
/// Three vertices a row.
@group(0) @binding(3) var<storage, read> corners: array<u32>;
struct Node {
    transform: mat4x4f,
    /// For normals.
    turn: mat3x3f,
}
@group(0) @binding(4) var<storage, read> nodes: array<Node>;
@group(0) @binding(5) var<storage, read_write> rows: array<u32>;

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

/// Scales to unit length; returns `without` for a vector that has no direction.
fn unit(v: vec3f, without: vec3f) -> vec3f {
    let squared = v.x * v.x + v.y * v.y + v.z * v.z;
    if squared > 0.0 && squared <= 3.4028234e38 {
        return v * (1.0 / sqrt(squared));
    }
    return without;
}

@compute @workgroup_size(64)
fn to_world(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let range = RANGES + 2u * id.y;
    for (var i = id.x; i < job[range + 1u]; i += 64u * groups.x) {
        transform_row(job[range] + i);
    }
}

fn transform_row(row: u32) {
    let start = row * job[0];
    for (var corner = 0u; corner < 3u; corner++) {
        let vertex = corners[3u * row + corner];
        let first = 10u * vertex;
        let node = vertices[first + 8u];
        let m = nodes[node].transform;
        let part = mat3x3f(m[0].xyz, m[1].xyz, m[2].xyz);
        if job[POSITIONS + corner] != ABSENT {
            put(start + job[POSITIONS + corner], turned(part, three(first)) + m[3].xyz);
        }
        if job[NORMALS + corner] != ABSENT {
            let normal = turned(nodes[node].turn, three(first + 3u));
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
