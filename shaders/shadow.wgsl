//! Depth of the scene from one view of a light. With LIGHT_UNIFORMS the rows of views lie in a uniform.
#import lightgraph::geometry::world_position

struct LightView {
    view_projection: mat4x4f,
}
#ifdef LIGHT_UNIFORMS
var<uniform> light_views: array<LightView, #{VIEW_ROWS}>;
#else
var<storage, read> light_views: array<LightView>;
#endif

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) node: u32,
    @builtin(instance_index) view: u32,
) -> @builtin(position) vec4f {
    return light_views[view].view_projection * vec4f(world_position(node, position), 1.0);
}
