//! Indirect light in the image from the rays of the points round each pixel. A ray's end sends light to the pixel as it
//! does to the point it was traced from, as far as both see it; it counts by how likely the pixel would have met it.
//! Ends near by are shared with few pixels, far ones with many: what hides one from a pixel but not from its neighbour
//! mostly lies at the distance of what it hides, or nearer.
#import lightgraph::camera::{camera, pixel_ray}
#ifdef DOUBT
#import lightgraph::gloss::as_matte
#else
#import lightgraph::gloss::matte
#endif
#import lightgraph::packed_light
#import lightgraph::photons::{RAYS_A_SOURCE, from_source}
#import lightgraph::points::{has_point, points}
#import lightgraph::rays::{OF_SKY, unpack_flat_normal, unpack_normal}
#import lightgraph::rounds::round
#import lightgraph::seen::{finished, seen_at}
#ifdef ENVIRONMENT
#import lightgraph::sky_guide::{block_of, drawn_density}
#endif
#ifdef LOBES
#import lightgraph::gloss::shines
#import lightgraph::shared_lobes::by_shared
#endif
#import lightgraph::source_texels::source_at
#import lightgraph::surface::{Surface, is_lit, read_record}
#import lightgraph::tiles::{NO_DOUBT, NO_POINT, TILE, WAITS, point_pixel, points_across}

struct Params {
    rays: u32,
    /// Points to each side.
    reach: u32,
#ifdef ENVIRONMENT
    /// See `sky_guide::draws`.
    environment_samples: u32,
#endif
}
var<uniform> params: Params;
/// See share_light.wgsl.
var ray_texels: texture_storage_2d<rgba32uint, read>;
const RAYS_A_ROW: u32 = 1024u;
#ifdef DOUBT
/// Variance of each point's light, the sum of the channels.
var<storage, read_write> doubts: array<f32>;
#else
/// Rays that a point has beside those that all have: the first row and the number.
var<storage, read> more: array<vec2u>;
/// Rays before those.
const COUNT: u32 = #{COUNT}u;
var indirect: texture_storage_2d<rgba32float, write>;
#ifdef LOBES
/// See lobe_rays.wgsl.
var lobe_light: texture_2d<f32>;
#endif
#endif

#ifdef ENVIRONMENT
#ifndef DOUBT
/// See traced_direct.wgsl.
var drawn_sky: texture_2d<f32>;
/// The environment's matte light in the image.
var first_sky: texture_storage_2d<rgba32float, write>;
#endif
#endif

/// Neighbours count whose normals differ by less than acos of this, and whose planes lie closer than this share of
/// their distance.
const SAME_NORMAL: f32 = 0.9;
const SAME_PLANE: f32 = 0.3;
/// Farther than this many times the way between pixel and point lies what they share.
const FAR_ENOUGH: f32 = 2.0;
/// How much more likely than its point a pixel may count to meet an end: the point of a large tile lies farther away.
const MOST: f32 = 4.0 * f32(TILE * TILE);
/// Steps of distance, each twice the one before.
const STEPS: u32 = 8u;

/// Rounds with the whole reach. Later ones have noise enough taken off by their number, and share with the nearest
/// points alone.
const WIDE_ROUNDS: u32 = 8u;

/// Points to each side that are shared with in this round.
fn reach() -> i32 {
    return i32(select(min(params.reach, 1u), params.reach, round() < WIDE_ROUNDS));
}

/// A point of the image, as a pixel sees it.
struct Neighbour {
    /// 0 for one that lies elsewhere.
    weight: f32,
    index: u32,
    position: vec3f,
    normal: vec3f,
    /// Steps of distance from which on it shares what it met; those nearest to the pixel share all.
    step: u32,
    /// Its rays beside those that all have.
    more: vec2u,
}

/// Metres of a pixel at its distance.
var<private> footprint: f32;
/// The least step of a neighbour.
var<private> nearest: u32;
/// Whether neighbours count that lie on other surfaces: where no point lies on the pixel's own, as on what is thinner
/// than a tile.
var<private> any_surface: bool;

fn shares(n: Neighbour, step: u32) -> bool {
    return step >= n.step || n.step == nearest;
}

fn step_of(distance: f32) -> u32 {
    return u32(clamp(ceil(log2(max(distance / footprint, 1e-6))), 0.0, f32(STEPS - 1u)));
}

fn neighbour(s: Surface, tile: vec2i, step: vec2i) -> Neighbour {
    var n = Neighbour();
    let across = points_across();
    let at = tile + step;
    if any(at < vec2i(0)) || any(at >= vec2i(across)) {
        return n;
    }
    n.index = u32(at.y) * across.x + u32(at.x);
    let point = points[n.index];
    n.normal = unpack_normal(point.w);
    if point.w == NO_POINT || !any_surface && dot(n.normal, s.normal) < SAME_NORMAL {
        return n;
    }
    n.position = bitcast<vec3f>(point.xyz);
    let offset = n.position - s.position;
    let way = length(offset);
    if !any_surface && abs(dot(offset, s.normal)) > SAME_PLANE * way {
        return n;
    }
    let edge = vec2i(reach());
    n.weight = select(1.0, 0.5, abs(step.x) == edge.x) * select(1.0, 0.5, abs(step.y) == edge.y);
    n.step = step_of(FAR_ENOUGH * way);
#ifndef DOUBT
    n.more = more[n.index];
#endif
    return n;
}

#ifdef LOBES
/// Whether the pixel's surface has lobes.
var<private> has_lobes: bool;
#endif
/// What the pixel has of its neighbours' rays, so far.
struct Sums {
    /// Light of ray ends by their weights, and the weights.
    ends: vec4f,
    /// Light of sources.
    straight: vec3f,
#ifdef ENVIRONMENT
    /// Light of the environment, by the weights of ends.
    sky: vec3f,
#endif
#ifdef LOBES
    /// Light of ends that lobes reflect, by their weights; and of sources.
    lobes: vec3f,
    straight_lobes: vec3f,
#endif
#ifdef DOUBT
    /// Squares of weights, times the end's light, times that again; of the sources' light.
    squares: vec4f,
#endif
}
var<private> sums: Sums;
#ifdef ENVIRONMENT
/// See `lightgraph::sky_guide`.
var<private> block: u32;
#endif

#ifdef ENVIRONMENT
/// Radiance of the environment along a ray that is met under a cosine, weighed against directions that pixels draw this
/// densely.
fn from_sky(radiance: vec3f, cosine: f32, drawn: f32) -> vec3f {
    let others = f32(#{SHARED_RAYS}) * cosine / 3.14159265359;
    return radiance * others / max(others + drawn, 1e-20);
}
#endif

/// Adds what the neighbour sees of a source, and its ray's end. `weights`: of the neighbour, by the step of distance.
fn add(s: Surface, n: Neighbour, weights: ptr<function, array<f32, STEPS>>, row: u32) {
    let place = vec2u(2u * (row % RAYS_A_ROW), row / RAYS_A_ROW);
    let end = textureLoad(ray_texels, place);
    let brings = textureLoad(ray_texels, place + vec2u(1u, 0u));
#ifdef ENVIRONMENT
    let of_sky = (brings.z & OF_SKY) != 0u;
    let look = vec2u(brings.z & ~OF_SKY, brings.w);
#else
    let look = brings.zw;
#endif
    if look.y != 0u {
        let source = source_at(look.x);
        let step = step_of(distance(source.position, n.position));
        if shares(n, step) {
            let weight = n.weight * (*weights)[step] * bitcast<f32>(look.y);
            let light = weight * from_source(source, s.position, s.normal, RAYS_A_SOURCE);
            sums.straight += light;
#ifdef LOBES
            if has_lobes {
                sums.straight_lobes += light * by_shared(s, normalize(source.position - s.position));
            }
#endif
#ifdef DOUBT
            let bright = dot(light, vec3f(1.0));
            sums.squares.w += bright * bright;
#endif
        }
    }
    let to_here = bitcast<vec3f>(end.xyz) - s.position;
    let to_there = bitcast<vec3f>(end.xyz) - n.position;
    let here2 = max(dot(to_here, to_here), 1e-12);
    let there2 = max(dot(to_there, to_there), 1e-12);
    let step = step_of(sqrt(there2));
    if !shares(n, step) {
        return;
    }
    let way_here = to_here * inverseSqrt(here2);
    let way_there = to_there * inverseSqrt(there2);
#ifdef ENVIRONMENT
    if of_sky {
        let cosine = max(dot(s.normal, way_here), 0.0);
        let likely = min(cosine / max(dot(n.normal, way_there), 1e-3), MOST);
        let weight = n.weight * (*weights)[step] * likely;
        let drawn = drawn_density(block, params.environment_samples, way_here, bitcast<f32>(end.w));
        let sent = from_sky(packed_light::unpack(brings.xy), cosine, drawn);
        sums.sky += weight * sent;
        sums.ends.a += weight;
#ifdef DOUBT
        let bright = dot(sent, vec3f(1.0));
        sums.squares += weight * weight * vec4f(1.0, bright, bright * bright, 0.0);
#endif
        return;
    }
#endif
    let normal = unpack_flat_normal(end.w);
    let meets_here = max(dot(s.normal, way_here), 0.0) * max(-dot(normal, way_here), 0.0) / here2;
    let meets_there = max(dot(n.normal, way_there), 1e-3) * max(-dot(normal, way_there), 1e-3) / there2;
    let share = n.weight * (*weights)[step] * min(meets_here / meets_there, MOST);
    let sent = packed_light::unpack(brings.xy);
    sums.ends += share * vec4f(sent, 1.0);
#ifdef LOBES
    if has_lobes {
        sums.lobes += share * sent * by_shared(s, way_here);
    }
#endif
#ifdef DOUBT
    let bright = dot(sent, vec3f(1.0));
    sums.squares += share * share * vec4f(1.0, bright, bright * bright, 0.0);
#endif
}

/// The next of the points around, row by row: for one loop that tests at its end, where llvmpipe runs nested ones that
/// test at their start more often than there are points.
fn next_step(step: vec2i, edge: i32) -> vec2i {
    return select(step + vec2i(1, 0), vec2i(-edge, step.y + 1), step.x == edge);
}

@compute @workgroup_size(8, 8)
fn share_rays(@builtin(global_invocation_id) id: vec3u) {
#ifdef DOUBT
    let across = points_across();
    if any(id.xy >= across) {
        return;
    }
    let pixel = point_pixel(id.xy);
#else
    if any(id.xy >= camera.screen) {
        return;
    }
    let pixel = id.xy;
#endif
    let seen = seen_at(pixel);
#ifdef DOUBT
    let point = id.y * across.x + id.x;
    if points[point].w == NO_POINT {
        doubts[point] = select(NO_DOUBT, WAITS, is_lit(seen.albedo));
        return;
    }
#else
    if !is_lit(seen.albedo) || !has_point(pixel) {
        textureStore(indirect, pixel, vec4f(0.0, 0.0, 0.0, 1.0));
#ifdef ENVIRONMENT
        textureStore(first_sky, pixel, vec4f(0.0));
#endif
        return;
    }
#endif
    let ray = pixel_ray(pixel);
    let s = finished(read_record(seen.albedo, seen.normal, ray.origin, ray.direction), pixel);
    let beside = pixel_ray(pixel + vec2u(1u, 0u));
    footprint = length(beside.origin + seen.normal.w * beside.direction - s.position);
    let tile = vec2i(pixel / TILE);
#ifdef LOBES
    has_lobes = shines(s);
#endif
#ifdef ENVIRONMENT
    block = block_of(pixel);
#endif
    let edge = reach();
    // How many rays are shared that end as far as a step says; then one over that.
    var sharing = array<f32, STEPS>();
    loop {
        var step = vec2i(-edge);
        loop {
            let n = neighbour(s, tile, step);
            let weight = n.weight * f32(params.rays + n.more.y);
            for (var i = 0u; i < STEPS; i++) {
                sharing[i] += select(0.0, weight, i >= n.step);
            }
            step = next_step(step, edge);
            if step.y > edge {
                break;
            }
        }
        if any_surface || sharing[STEPS - 1u] > 0.0 {
            break;
        }
        any_surface = true;
    }
    // Where no point lies near enough, those that do lie nearest.
    nearest = 0u;
    for (var i = STEPS - 1u; i > 0u; i--) {
        if sharing[i - 1u] == 0.0 {
            sharing[i - 1u] = sharing[i];
            nearest = max(nearest, i);
        }
    }
    for (var i = 0u; i < STEPS; i++) {
        sharing[i] = 1.0 / max(sharing[i], 1e-20);
    }
    var step = vec2i(-edge);
    loop {
        let n = neighbour(s, tile, step);
        let rays = select(0u, params.rays + n.more.y, n.weight > 0.0);
        var k = 0u;
        loop {
            if k < rays {
#ifdef DOUBT
                add(s, n, &sharing, n.index * params.rays + k);
#else
                // Those that all points have, then its own.
                let own = COUNT + n.more.x + k - params.rays;
                add(s, n, &sharing, select(own, n.index * params.rays + k, k < params.rays));
#endif
            }
            k++;
            if k >= rays {
                break;
            }
        }
        step = next_step(step, edge);
        if step.y > edge {
            break;
        }
    }
    let mean = sums.ends.rgb / max(sums.ends.a, 1e-6);
#ifdef DOUBT
#ifdef ENVIRONMENT
    let bright = dot(mean + sums.sky / max(sums.ends.a, 1e-6), vec3f(1.0));
#else
    let bright = dot(mean, vec3f(1.0));
#endif
    let q = sums.squares;
    let variance = (q.z - 2.0 * bright * q.y + bright * bright * q.x) / max(sums.ends.a * sums.ends.a, 1e-12) + q.w;
    let albedo = dot(as_matte(s), vec3f(0.333));
    doubts[point] = albedo * albedo * max(variance, 0.0);
#else
    var light = matte(s) * (mean + sums.straight);
#ifdef LOBES
    light += textureLoad(lobe_light, pixel, 0).rgb;
    light += sums.straight_lobes + sums.lobes / max(sums.ends.a, 1e-6);
#endif
    textureStore(indirect, pixel, vec4f(light, 1.0));
#ifdef ENVIRONMENT
    let by_rays = matte(s) * sums.sky / max(sums.ends.a, 1e-6);
    textureStore(first_sky, pixel, vec4f(textureLoad(drawn_sky, pixel, 0).rgb + by_rays, 1.0));
#endif
#endif
}
