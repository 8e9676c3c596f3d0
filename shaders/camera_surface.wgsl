//! What the camera sees through the centre of each pixel. With FINISH, roughness and metalness of metals, too.
#import lightgraph::geometry::{world_position, world_normal}
#import lightgraph::camera::pixel_ray
#import lightgraph::surface::{Point, record}
#ifdef FINISH
#import lightgraph::surface::recorded_finish
#endif
#ifdef NORMAL_MAPS
#import lightgraph::geometry::world_tangent
#endif
#ifdef MORE_AT_VERTICES
#import lightgraph::vertices::vertices
#endif

var<uniform> camera_view_projection: mat4x4f;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) node: u32,
    @location(4) material: u32,
}

struct Varying {
    @builtin(position) at: vec4f,
    @location(0) world: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) @interpolate(flat) material: u32,
#ifdef SECOND_UVS
    @location(4) second_uv: vec2f,
#endif
#ifdef VERTEX_COLORS
    @location(5) color: vec4f,
#endif
#ifdef NORMAL_MAPS
    @location(6) tangent: vec4f,
#endif
}

@vertex
fn vertex(
    in: Vertex,
#ifdef MORE_AT_VERTICES
    @builtin(vertex_index) index: u32,
#endif
) -> Varying {
    let world = world_position(in.node, in.position);
    var out: Varying;
    out.at = camera_view_projection * vec4f(world, 1.0);
    out.world = world;
    out.normal = world_normal(in.node, in.normal);
    out.uv = in.uv;
    out.material = in.material;
#ifdef SECOND_UVS
    out.second_uv = vertices[index].second_uv;
#endif
#ifdef VERTEX_COLORS
    out.color = vertices[index].color;
#endif
#ifdef NORMAL_MAPS
    out.tangent = world_tangent(in.node, vertices[index].tangent);
#endif
    return out;
}

struct Seen {
    @location(0) surface_albedo: vec4f,
    @location(1) surface_normal: vec4f,
#ifdef FINISH
    @location(2) surface_finish: vec4f,
#endif
}

/// Metres along the ray through the pixel's centre to the plane that holds `world` and has this normal of any length.
/// Drivers round corners, so that `world` itself need not lie on the ray; see `along` of lightgraph::cube.
fn along_ray(pixel: vec2u, world: vec3f, normal: vec3f) -> f32 {
    let ray = pixel_ray(pixel);
    let shown = distance(world, ray.origin);
    let slope = dot(ray.direction, normal);
    let met = clamp(dot(world - ray.origin, normal) / select(slope, 1.0, slope == 0.0), 0.8 * shown, 1.25 * shown);
    return select(met, shown, slope == 0.0);
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> Seen {
    let depth = along_ray(vec2u(in.at.xy), in.world, cross(dpdx(in.world), dpdy(in.world)));
    var p: Point;
    p.uv = in.uv;
#ifdef SECOND_UVS
    p.second_uv = in.second_uv;
#endif
#ifdef VERTEX_COLORS
    p.color = in.color;
#endif
#ifdef NORMAL_MAPS
    p.tangent = in.tangent;
#endif
#ifdef FINISH
    let finish = recorded_finish(in.material, p);
    let r = record(in.material, p, in.normal, depth, front);
    return Seen(r.albedo, r.normal, vec4f(finish, 0.0, 0.0));
#else
    let r = record(in.material, p, in.normal, depth, front);
    return Seen(r.albedo, r.normal);
#endif
}
