//! Depth of the scene from one view of a light. With LIGHT_UNIFORMS the rows of views lie in a uniform; with MASKS
//! holes let light through.
#import lightgraph::geometry::world_position
#ifdef MASKS
#import lightgraph::holes::{Cut, cut_at, end_in_hole}
#endif

struct LightView {
    view_projection: mat4x4f,
}
#ifdef LIGHT_UNIFORMS
var<uniform> light_views: array<LightView, #{VIEW_ROWS}>;
#else
var<storage, read> light_views: array<LightView>;
#endif

#ifdef MASKS
struct Varying {
    @builtin(position) at: vec4f,
    @location(0) uv: vec2f,
    @location(1) second_uv: vec2f,
    @location(2) alpha: f32,
    @location(3) @interpolate(flat) material: u32,
}

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) uv: vec2f,
    @location(2) node: u32,
    @location(3) material: u32,
    @builtin(vertex_index) index: u32,
    @builtin(instance_index) view: u32,
) -> Varying {
    let cut = cut_at(index, uv);
    let at = light_views[view].view_projection * vec4f(world_position(node, position), 1.0);
    return Varying(at, cut.uv, cut.second_uv, cut.alpha, material);
}

@fragment
fn fragment(in: Varying) {
    end_in_hole(in.material, Cut(in.uv, in.second_uv, in.alpha));
}
#else
@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) node: u32,
    @builtin(instance_index) view: u32,
) -> @builtin(position) vec4f {
    return light_views[view].view_projection * vec4f(world_position(node, position), 1.0);
}
#endif
