//! The light that each gathered ray brings, as pixels share it.
#import lightgraph::cells::NO_CELL
#import lightgraph::packed_light
#import lightgraph::photons::{RAYS_A_SOURCE, density_of, form, share_of_ray, sum_of}
#import lightgraph::rays::{unpack, unpack_normal}
#ifdef MORE
#import lightgraph::find_cell::find_near
#import lightgraph::tiles::NO_POINT
#endif

var<uniform> rays: u32;
struct Count {
    count: u32,
    scale: f32,
}
var<storage, read> source_count: Count;
var<storage, read> points: array<vec4u>;
var<storage, read> emitted: array<vec4f>;
var<storage, read> gathered: array<vec4u>;
/// See cell_total.wgsl.
var<storage, read> held: array<vec4f>;
var<storage, read_write> light: array<vec2u>;

/// Rays that all points have.
const COUNT: u32 = #{COUNT}u;
#ifdef MORE
/// Rays beside those, and rows of `gathered` before them.
const MORE: u32 = #{MORE}u;
const BEFORE: u32 = #{BEFORE}u;
var<storage, read> more_points: array<u32>;

/// What the cells that a point's rays met hold on the mean.
fn mean_held(point: u32) -> vec3f {
    var sum = vec4f(0.0);
    for (var i = point * rays; i < (point + 1u) * rays; i++) {
        let cell = gathered[2u * i + 1u].w;
        if cell != NO_CELL {
            sum += vec4f(held[cell].rgb, 1.0);
        }
    }
    return sum.rgb / max(sum.a, 1.0);
}

@compute @workgroup_size(64)
fn share_light(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= MORE {
        return;
    }
    let point = more_points[id.x];
    let row = BEFORE + id.x;
    if point == NO_POINT {
        return;
    }
    let met = unpack(gathered[2u * row], gathered[2u * row + 1u]);
    var sum = vec3f(0.0);
    if met.cell != 0u {
        let cell = find_near(met.position, met.normal);
        if cell == NO_CELL {
            // No ray came there when cells began.
            sum = met.albedo * mean_held(point);
        } else {
            sum = met.albedo * held[cell].rgb;
        }
        let at = points[point];
        let offset = met.position - bitcast<vec3f>(at.xyz);
        let arrived = met.lit + select(vec3f(0.0), emitted[min(cell, arrayLength(&emitted) - 1u)].rgb, cell != NO_CELL);
        let density = density_of(sum_of(arrived), source_count.scale);
        sum += met.albedo * arrived
            * share_of_ray(form(offset, unpack_normal(at.w), met.normal), density, RAYS_A_SOURCE);
    }
    light[COUNT + id.x] = packed_light::pack(sum);
}
#else
@compute @workgroup_size(64)
fn share_light(@builtin(global_invocation_id) id: vec3u) {
    let index = id.x;
    if index >= COUNT {
        return;
    }
    let met = unpack(gathered[2u * index], gathered[2u * index + 1u]);
    var sum = met.albedo * met.lit;
    if met.cell != NO_CELL {
        let point = points[index / rays];
        let offset = met.position - bitcast<vec3f>(point.xyz);
        let arrived = met.lit + emitted[met.cell].rgb;
        let density = density_of(sum_of(arrived), source_count.scale);
        let share = share_of_ray(form(offset, unpack_normal(point.w), met.normal), density, RAYS_A_SOURCE);
        sum = met.albedo * (arrived * share + held[met.cell].rgb);
    }
    light[index] = packed_light::pack(sum);
}
#endif
