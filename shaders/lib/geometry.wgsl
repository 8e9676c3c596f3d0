//! The scene's vertices in the world.
#define_import_path lightgraph::geometry

struct Node {
    transform: mat4x4f,
    /// For normals.
    inverse_transpose: mat4x4f,
}
var<storage, read> nodes: array<Node>;

/// Position in metres, in the world.
fn world_position(node: u32, position: vec3f) -> vec3f {
    return (nodes[node].transform * vec4f(position, 1.0)).xyz;
}

/// Direction of the normal in the world; not of unit length.
fn world_normal(node: u32, normal: vec3f) -> vec3f {
    return (nodes[node].inverse_transpose * vec4f(normal, 0.0)).xyz;
}
