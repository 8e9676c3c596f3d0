#define_import_path placed

struct Node { transform: mat4x4f }
struct LightView { view_projection: mat4x4f }
var<storage, read> nodes: array<Node>;
var<storage, read> light_views: array<LightView>;
var<uniform> camera_view_projection: mat4x4f;

fn seen(position: vec3f, node: u32) -> vec4f {
    return camera_view_projection * nodes[node].transform * vec4f(position, 1.0);
}

fn lit(light: u32, position: vec3f, node: u32) -> vec4f {
    return light_views[light].view_projection * nodes[node].transform * vec4f(position, 1.0);
}
