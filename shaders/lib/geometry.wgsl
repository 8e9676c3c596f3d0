//! The scene's vertices in the world. With NODE_UNIFORMS the rows of nodes lie in a uniform: for scenes that have few.
#define_import_path lightgraph::geometry

struct Node {
    transform: mat4x4f,
    /// For normals.
    inverse_transpose: mat4x4f,
}
#ifdef NODE_UNIFORMS
var<uniform> nodes: array<Node, #{NODE_ROWS}>;

fn node_count() -> u32 {
    return #{NODE_ROWS}u;
}
#else
var<storage, read> nodes: array<Node>;

fn node_count() -> u32 {
    return arrayLength(&nodes);
}
#endif

/// Position in metres, in the world.
fn world_position(node: u32, position: vec3f) -> vec3f {
    return (nodes[node].transform * vec4f(position, 1.0)).xyz;
}

/// Direction of the normal in the world; not of unit length.
fn world_normal(node: u32, normal: vec3f) -> vec3f {
    return (nodes[node].inverse_transpose * vec4f(normal, 0.0)).xyz;
}

#ifdef NORMAL_MAPS
/// A tangent in the world; not of unit length. What mirrors turns the third axis round, whose side stands in w.
fn world_tangent(node: u32, tangent: vec4f) -> vec4f {
    let m = nodes[node].transform;
    let turn = mat3x3f(m[0].xyz, m[1].xyz, m[2].xyz);
    return vec4f(turn * tangent.xyz, select(tangent.w, -tangent.w, determinant(turn) < 0.0));
}
#endif
