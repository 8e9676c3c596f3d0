//! The light that each gathered ray brings, as pixels share it; with FIRST that of the first bounce alone.
#import lightgraph::cells::PLACES
#import lightgraph::packed_light
#import lightgraph::photons::{Count, RAYS_A_SOURCE, form, halves_of, share_of_ray, sum_of}
#import lightgraph::points::points
#import lightgraph::rays::{OF_SKY, Ray, SKY, unpack, unpack_normal}
#import lightgraph::tiles::points_across
#ifdef MORE
#import lightgraph::find_cell::find_near
#import lightgraph::tiles::NO_POINT
#endif

var<uniform> rays: u32;
var<storage, read> source_count: Count;
var<storage, read> emitted: array<vec4f>;
var<storage, read> gathered: array<vec4u>;
#ifndef FIRST
/// See cell_total.wgsl.
var<storage, read> held: array<vec4f>;
#endif
/// See connect_points.wgsl.
var<storage, read> shown: array<vec2u>;
/// Of each ray: where it ended and which way the surface there faces; the light it brings, and what its point sees of a
/// source.
var ray_texels: texture_storage_2d<rgba32uint, write>;
const RAYS_A_ROW: u32 = 1024u;

/// What pixels read of ray `row`, which stands in row `from` of those gathered.
fn put(row: u32, from_row: u32, light: vec3f) {
    let place = vec2u(2u * (row % RAYS_A_ROW), row / RAYS_A_ROW);
    var brings = vec4u(packed_light::pack(light), shown[row]);
#ifdef ENVIRONMENT
    let met = gathered[2u * from_row + 1u];
    if met.w == SKY {
        brings = vec4u(met.xy, brings.z | OF_SKY, brings.w);
    }
#endif
    textureStore(ray_texels, place, gathered[2u * from_row]);
    textureStore(ray_texels, place + vec2u(1u, 0u), brings);
}

/// Rays that all points have.
const COUNT: u32 = #{COUNT}u;

/// What a cell has straight from emitters (see cell_emission.wgsl), and of all bounces.
struct OfCell {
    emitted: vec4f,
    held: vec3f,
}

fn of_cell(cell: u32) -> OfCell {
#ifdef FIRST
    return OfCell(emitted[cell], vec3f(0.0));
#else
    return OfCell(emitted[cell], held[cell].rgb);
#endif
}

/// What the cells that rays of a point and of those beside it met have on the mean.
fn mean_of_cells(point: u32) -> OfCell {
    let across = points_across();
    let at = vec2u(point % across.x, point / across.x);
    let last = min(at + 1u, across - 1u);
    var sum = OfCell();
    var found = 0.0;
    for (var y = max(at.y, 1u) - 1u; y <= last.y; y++) {
        for (var x = max(at.x, 1u) - 1u; x <= last.x; x++) {
            let first = (y * across.x + x) * rays;
            for (var i = first; i < first + rays; i++) {
                let cell = gathered[2u * i + 1u].w;
                if cell < PLACES {
                    let one = of_cell(cell);
                    sum.emitted += one.emitted;
                    sum.held += one.held;
                    found += 1.0;
                }
            }
        }
    }
    return OfCell(sum.emitted / max(found, 1.0), sum.held / max(found, 1.0));
}

/// What a ray brings a point from what it met, in a cell or, where too few rays came for one, in none.
fn brought(met: Ray, point: u32, cell: u32) -> vec3f {
    // Black surfaces send nothing on; rays that met nothing count as black.
    if all(met.albedo <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    var there = OfCell();
    if cell < PLACES {
        there = of_cell(cell);
    } else {
        there = mean_of_cells(point);
    }
    let arrived = met.lit + there.emitted.rgb;
    let evenly = exp2(met.evenly) * sum_of(met.lit) + sum_of(there.emitted.rgb);
    let at = points[point];
    let found = form(met.position - bitcast<vec3f>(at.xyz), unpack_normal(at.w), met.flat_normal);
    let halves = halves_of(evenly, there.emitted.a);
    return met.albedo * (there.held + arrived * share_of_ray(found, halves, source_count.scale, RAYS_A_SOURCE));
}

#ifdef MORE
/// Rays beside those, and rows of `gathered` before them.
const MORE: u32 = #{MORE}u;
const BEFORE: u32 = #{BEFORE}u;
var<storage, read> more_points: array<u32>;

@compute @workgroup_size(64)
fn share_light(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= MORE || more_points[min(id.x, MORE - 1u)] == NO_POINT {
        return;
    }
    let row = BEFORE + id.x;
    let met = unpack(gathered[2u * row], gathered[2u * row + 1u]);
    var sum = vec3f(0.0);
    // Those that met nothing have no key.
    if met.cell != 0u && met.cell != SKY {
        sum = brought(met, more_points[id.x], find_near(met.position, met.normal));
    }
    put(COUNT + id.x, row, sum);
}
#else
@compute @workgroup_size(64)
fn share_light(@builtin(global_invocation_id) id: vec3u) {
    let index = id.x;
    if index >= COUNT {
        return;
    }
    let met = unpack(gathered[2u * index], gathered[2u * index + 1u]);
    put(index, index, brought(met, index / rays, met.cell));
}
#endif
