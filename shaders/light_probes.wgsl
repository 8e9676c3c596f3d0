//! A bounce in one dispatch, a workgroup a probe: the surfaces that the probe sees are lit, and what they send it is
//! projected and summed up. With FIRST_BOUNCE by the lights, or with LIT_BEFORE as another pass has lit them; else by
//! the probes round them, as of the bounce before, and what the first bounce found is added. A probe is an instance.
#import lightgraph::cube
#import lightgraph::cube_sums
#import lightgraph::instances
#import lightgraph::packed_probes::{STEPS, TEXELS, packed_place}
#import lightgraph::packed_surface::surface_at
#import lightgraph::probes
#import lightgraph::projection
#import lightgraph::sh::COUNT
#import lightgraph::surface::{is_back, is_lit}
#ifdef FIRST_BOUNCE
#ifdef LIT_BEFORE
#import lightgraph::packed_light
#else
#ifdef ENVIRONMENT
#import lightgraph::environment
#import lightgraph::surface::is_nothing
#endif
#ifdef LIGHTS
#import lightgraph::surface::read_record
#import lightgraph::lights::reflected_light
#endif
#endif
#else
#import lightgraph::packed_indirect
#endif

struct Params {
    grid: vec3u,
    cube_surface_tile: u32,
    cube_surface_columns: u32,
#ifndef FIRST_BOUNCE
    behind_captured: f32,
#endif
}
var<uniform> params: Params;
#ifdef FIRST_BOUNCE
#ifdef LIT_BEFORE
var cube_direct: texture_2d<u32>;
#endif
var first_sh: texture_storage_3d<rgba32float, write>;
var first_packed: texture_storage_2d<rgba32uint, write>;
#else
#ifdef PROBE_VISIBILITY
/// What sees each texel.
var cube_sight: texture_2d<u32>;
#endif
/// What the first bounce found.
var first_sh: texture_3d<f32>;
var sh: texture_storage_3d<rgba32float, write>;
var packed: texture_storage_2d<rgba32uint, write>;
#endif

/// Powers of two, more than one lane together.
const LANES_X: u32 = #{LANES_X}u;
const LANES_Y: u32 = #{LANES_Y}u;
const LANES: u32 = LANES_X * LANES_Y;
/// Lanes whose sums are added up one after the other. With HALVES the upper half hands its sums to the lower one, and
/// so on, until one has all.
#ifdef HALVES
const PARTS: u32 = 1u;
#else
const PARTS: u32 = LANES;
#endif
const PLACES: u32 = max(LANES / 2u, PARTS);

/// What a lane has summed up.
struct Mine {
    light: cube_sums::Sums,
    /// Solid angles of the texels that show no back.
    open: f32,
}

/// The sums of some lanes: coefficient k of the one in place i at k * PLACES + i; then those of all in place 0, and the
/// probe's coefficients in place 1. The first of them has in alpha how open the probe is.
var<workgroup> sums: array<vec4f, PLACES * COUNT>;

@compute @workgroup_size(LANES_X, LANES_Y)
fn light_probes(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let probe = probes::coordinates(instances::number(group));
    let edge = params.cube_surface_tile;
    let columns = params.cube_surface_columns;
    let first = cube::corner(probes::number(probe) * 6u, edge, columns);
    let eye = probes::position(probe);
    var mine: Mine;
    for (var y = local.y; y < edge; y += LANES_Y) {
        for (var x = local.x; x < edge; x += LANES_X) {
            let texel = vec2u(x, y);
            // The same on all faces.
            let area = cube::solid_angle(texel, edge);
            let through = cube::within(texel, edge);
            let beside = cube::within_beside(texel, edge);
            var corner = first;
            for (var face = 0u; face < 6u; face++) {
                let sent = light_of(eye, cube::outward(face, beside), corner + texel, area);
                let ray = cube::outward(face, through);
                mine.light = cube_sums::with_texel(mine.light, sent.light, ray, area, face, texel, edge);
#ifdef FIRST_BOUNCE
                mine.open += select(area, 0.0, sent.back);
#endif
                corner.x += edge;
                if corner.x == columns * edge {
                    corner = vec2u(0u, corner.y + edge);
                }
            }
        }
    }
#ifdef HALVES
    for (var half = LANES / 2u; half >= PARTS; half /= 2u) {
        if lane >= half && lane < 2u * half {
            spread(mine, lane - half);
        }
        workgroupBarrier();
        if lane < half {
            mine = gathered(mine, lane);
        }
        workgroupBarrier();
    }
#endif
    if lane < PARTS {
        spread(mine, lane);
    }
    workgroupBarrier();
    for (var k = lane; k < COUNT; k += LANES) {
        var total = sums[k * PLACES];
        for (var i = 1u; i < PARTS; i++) {
            total += sums[k * PLACES + i];
        }
        sums[k * PLACES] = total;
    }
#ifdef LEAST_SQUARES
    workgroupBarrier();
#endif
    for (var k = lane; k < COUNT; k += LANES) {
        var total = sums[k * PLACES];
#ifdef LEAST_SQUARES
        var light = vec3f(0.0);
        for (var j = 0u; j < COUNT; j++) {
            light += projection::inverse_gram[k * COUNT + j] * sums[j * PLACES].rgb;
        }
        total = vec4f(light, total.a);
#endif
        total *= projection::window(u32(sqrt(f32(k) + 0.5)));
        let at = vec3u(probe.xy, probe.z + k * params.grid.z);
#ifdef FIRST_BOUNCE
        textureStore(first_sh, at, total);
#else
        total += textureLoad(first_sh, at, 0);
        textureStore(sh, at, total);
#endif
        sums[k * PLACES + 1u] = total;
    }
    workgroupBarrier();
    for (var i = lane; i < TEXELS; i += LANES) {
        let at = packed_place(probe) + vec2u(i, 0u);
#ifdef FIRST_BOUNCE
        textureStore(first_packed, at, packed_texel(i));
#else
        textureStore(packed, at, packed_texel(i));
#endif
    }
}

/// What comes from a texel.
struct Sent {
    light: vec3f,
    /// It shows the back of a single-sided surface.
    back: bool,
}

fn light_of(eye: vec3f, ray: vec3f, at: vec2u, area: f32) -> Sent {
    let r = surface_at(at);
    var light = vec3f(0.0);
#ifdef FIRST_BOUNCE
#ifdef LIT_BEFORE
    // Backs have none; the environment's is there too.
    light = packed_light::unpack(textureLoad(cube_direct, at, 0).xy);
#else
#ifdef ENVIRONMENT
    if is_nothing(r.albedo, r.normal) {
        light = environment::mean_radiance(ray, area);
    }
#endif
#endif
#endif
    if is_lit(r.albedo) {
#ifdef FIRST_BOUNCE
#ifndef LIT_BEFORE
#ifdef LIGHTS
        light = reflected_light(read_record(r.albedo, r.normal, eye, ray));
#endif
#endif
#else
#ifdef PROBE_VISIBILITY
        let sight = textureLoad(cube_sight, at, 0).x;
#else
        let sight = packed_indirect::ALL;
#endif
        light = packed_indirect::reflected_probes(r, eye, ray, params.behind_captured, sight);
#endif
    }
    return Sent(light, is_back(r.albedo, r.normal));
}

/// Puts a lane's sums in a place.
fn spread(mine: Mine, place: u32) {
    let s = mine.light;
#if SH_ORDER >= 1
    spread_four(s.m0, 0u, place);
#endif
#if SH_ORDER >= 2
    spread_four(s.m1, 4u, place);
#endif
#if SH_ORDER >= 3
    spread_four(s.m2, 8u, place);
    spread_four(s.m3, 12u, place);
#endif
#if SH_ORDER >= 4
    spread_four(s.m4, 16u, place);
    spread_four(s.m5, 20u, place);
#endif
#if SH_ORDER != 1
#if SH_ORDER != 3
    sums[(COUNT - 1u) * PLACES + place] = vec4f(s.last, 0.0);
#endif
#endif
    sums[place].a = mine.open / probes::FULLY_OPEN;
}

/// A lane's sums and those in a place.
fn gathered(before: Mine, place: u32) -> Mine {
    var s = before.light;
#if SH_ORDER >= 1
    s.m0 += four(0u, place);
#endif
#if SH_ORDER >= 2
    s.m1 += four(4u, place);
#endif
#if SH_ORDER >= 3
    s.m2 += four(8u, place);
    s.m3 += four(12u, place);
#endif
#if SH_ORDER >= 4
    s.m4 += four(16u, place);
    s.m5 += four(20u, place);
#endif
#if SH_ORDER != 1
#if SH_ORDER != 3
    s.last += sums[(COUNT - 1u) * PLACES + place].rgb;
#endif
#endif
    return Mine(s, before.open + probes::FULLY_OPEN * sums[place].a);
}

fn four(first: u32, place: u32) -> mat4x3f {
    return mat4x3f(
        sums[first * PLACES + place].rgb,
        sums[(first + 1u) * PLACES + place].rgb,
        sums[(first + 2u) * PLACES + place].rgb,
        sums[(first + 3u) * PLACES + place].rgb,
    );
}

fn spread_four(m: mat4x3f, first: u32, place: u32) {
    sums[first * PLACES + place] = vec4f(m[0], 0.0);
    sums[(first + 1u) * PLACES + place] = vec4f(m[1], 0.0);
    sums[(first + 2u) * PLACES + place] = vec4f(m[2], 0.0);
    sums[(first + 3u) * PLACES + place] = vec4f(m[3], 0.0);
}

/// A texel of the packed probe, once `sums` holds its coefficients.
fn packed_texel(texel: u32) -> vec4u {
    var largest = 0.0;
    for (var k = 0u; k < COUNT; k++) {
        let c = abs(coefficient(k).rgb);
        largest = max(largest, max(c.r, max(c.g, c.b)));
    }
    let scale = STEPS / max(largest, 1e-30);
    if texel == TEXELS - 1u {
        let last = select(vec3f(0.0), coefficient(COUNT - 1u).rgb, COUNT % 2u == 1u) * scale;
        let open = 2.0 * coefficient(0u).a / probes::FULLY_OPEN - 1.0;
        return vec4u(
            two(last.r, last.g),
            two(last.b, clamp(open, -1.0, 1.0) * STEPS),
            bitcast<u32>(1.0 / (scale * 65536.0)),
            0u,
        );
    }
    let channel = texel % 3u;
    let first = texel / 3u * 8u;
    var words: vec4u;
    for (var i = 0u; i < 4u; i++) {
        let k = first + 2u * i;
        words[i] = two(part(k, channel) * scale, part(k + 1u, channel) * scale);
    }
    return words;
}

fn coefficient(k: u32) -> vec4f {
    return sums[k * PLACES + 1u];
}

fn part(k: u32, channel: u32) -> f32 {
    return select(0.0, coefficient(min(k, COUNT - 1u))[channel], k < COUNT);
}

/// Two steps in a word, the lower half first.
fn two(a: f32, b: f32) -> u32 {
    return (u32(i32(round(a))) & 0xffffu) | (u32(i32(round(b))) << 16u);
}
