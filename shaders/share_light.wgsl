//! The light that each gathered ray brings, as pixels share it.
#import lightgraph::cells::{NO_CELL, PLACES}
#import lightgraph::packed_light
#import lightgraph::photons::{density_of, form, share_of_ray, sum_of}
#import lightgraph::rays::{unpack, unpack_normal}

var<uniform> rays: u32;
struct Count {
    count: u32,
    scale: f32,
}
var<storage, read> source_count: Count;
var<storage, read> points: array<vec4u>;
var<storage, read> emitted: array<vec4f>;
const COUNT: u32 = #{COUNT}u;
var<storage, read> gathered: array<vec4u>;
var<storage, read> before: array<vec4f>;
var<storage, read> after: array<vec4f>;
#ifdef TAIL
var<storage, read> change: array<f32>;
#endif
var<storage, read_write> light: array<vec2u>;

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
        sum = met.albedo * arrived * share_of_ray(form(offset, unpack_normal(point.w), met.normal), density, 0.5);
        var held = after[met.cell].rgb;
#ifdef TAIL
        held += max(held - before[met.cell].rgb, vec3f(0.0)) * change[0] / (1.0 - change[0]);
#endif
        sum += met.albedo * held;
    }
    light[index] = packed_light::pack(sum);
}
