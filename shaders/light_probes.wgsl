//! A bounce in one dispatch, a workgroup a probe: the surfaces that the probe sees are lit, and what they send it is
//! projected and summed up. With FIRST_BOUNCE by emission and the lights, which is kept, or with LIT_BEFORE as
//! another pass has lit them; else by the probes round them as well, as of the bounce before. With BY_PROBE a probe is a member. With SIGHT the first bounce puts
//! what sees a texel beside its light, for the bounces after it: one fetch then gives both.
#import lightgraph::cube
#import lightgraph::cube_sums
#import lightgraph::packed_light
#import lightgraph::packed_probes::{STEPS, TEXELS, packed_place}
#import lightgraph::packed_surface::surface_at
#import lightgraph::probes
#import lightgraph::projection
#import lightgraph::sh::COUNT
#import lightgraph::surface::{is_back, is_lit}
#ifdef FIRST_BOUNCE
#ifndef LIT_BEFORE
#import lightgraph::surface::read_record
#ifdef LIGHTS
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
#ifdef BY_PROBE
var<storage, read> members: array<u32>;
#endif
#ifdef FIRST_BOUNCE
#ifdef LIT_BEFORE
var cube_direct: texture_2d<u32>;
#else
var cube_direct: texture_storage_2d<rg32uint, write>;
#endif
#else
var cube_direct: texture_2d<u32>;
#endif
#ifdef SIGHT
/// What sees each texel.
var cube_sight: texture_2d<u32>;
#endif
#ifdef FIRST_BOUNCE
var first_sh: texture_storage_3d<rgba32float, write>;
var first_packed: texture_storage_2d<rgba32uint, write>;
#else
var sh: texture_storage_3d<rgba32float, write>;
var packed: texture_storage_2d<rgba32uint, write>;
#endif

/// A power of two each.
const LANES_X: u32 = #{LANES_X}u;
const LANES_Y: u32 = #{LANES_Y}u;
const LANES: u32 = LANES_X * LANES_Y;
/// Lanes whose sums are added up one after the other. With HALVES the upper half hands its sums to the lower one, and so on, until one
/// has all.
#ifdef HALVES
const PARTS: u32 = 1u;
#else
const PARTS: u32 = LANES;
#endif
const PLACES: u32 = max(LANES / 2u, PARTS);

/// The sums of some lanes: coefficient k of the one in place i at k * PLACES + i; then in the first COUNT places those of all.
var<workgroup> sums: array<vec4f, PLACES * COUNT>;

@compute @workgroup_size(LANES_X, LANES_Y)
fn light_probes(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
#ifdef BY_PROBE
    let probe = probes::coordinates(members[group.z]);
#else
    let probe = group;
#endif
    let edge = params.cube_surface_tile;
    let columns = params.cube_surface_columns;
    let first = cube::corner(probes::number(probe) * 6u, edge, columns);
    let eye = probes::position(probe);
    var s: cube_sums::Sums;
    for (var y = local.y; y < edge; y += LANES_Y) {
        for (var x = local.x; x < edge; x += LANES_X) {
            let texel = vec2u(x, y);
            // The same on all faces.
            let area = cube::solid_angle(texel, edge);
            let through = cube::within(texel, edge);
            let beside = cube::within_beside(texel, edge);
            var corner = first;
            for (var face = 0u; face < 6u; face++) {
                let light = light_of(eye, cube::outward(face, beside), corner + texel);
                s = cube_sums::with_texel(s, light, cube::outward(face, through), area, face, texel, edge);
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
            spread(s, lane - half);
        }
        workgroupBarrier();
        if lane < half {
            s = gathered(s, lane);
        }
        workgroupBarrier();
    }
#endif
    if lane < PARTS {
        spread(s, lane);
    }
    workgroupBarrier();
    var total = vec4f(0.0);
    if lane < COUNT {
        for (var i = 0u; i < PARTS; i++) {
            total += sums[lane * PLACES + i];
        }
    }
    workgroupBarrier();
#ifdef LEAST_SQUARES
    if lane < COUNT {
        sums[lane] = total;
    }
    workgroupBarrier();
    if lane < COUNT {
        total = vec4f(0.0);
        for (var j = 0u; j < COUNT; j++) {
            total += projection::inverse_gram[lane * COUNT + j] * sums[j];
        }
    }
    workgroupBarrier();
#endif
    if lane < COUNT {
        total *= projection::window(u32(sqrt(f32(lane) + 0.5)));
        sums[lane] = total;
        let at = vec3u(probe.xy, probe.z + lane * params.grid.z);
#ifdef FIRST_BOUNCE
        textureStore(first_sh, at, total);
#else
        textureStore(sh, at, total);
#endif
    }
    workgroupBarrier();
    if lane < TEXELS {
        let at = packed_place(probe) + vec2u(lane, 0u);
#ifdef FIRST_BOUNCE
        textureStore(first_packed, at, packed_texel(lane));
#else
        textureStore(packed, at, packed_texel(lane));
#endif
    }
}

/// Light (and alpha, 0 for backs) that a texel sends.
fn light_of(eye: vec3f, ray: vec3f, at: vec2u) -> vec4f {
    let r = surface_at(at);
    var light = vec3f(0.0);
    if is_lit(r.albedo) {
#ifdef FIRST_BOUNCE
#ifdef LIT_BEFORE
        light = packed_light::unpack(textureLoad(cube_direct, at, 0).xy).light;
#else
        let s = read_record(r.albedo, r.normal, eye, ray);
#ifdef EMISSIVE
        light = s.emission;
#endif
#ifdef LIGHTS
        light += reflected_light(s);
#endif
#endif
#else
        let direct = packed_light::unpack(textureLoad(cube_direct, at, 0).xy);
#ifdef PROBE_VISIBILITY
        let sight = direct.number;
#else
        let sight = packed_indirect::ALL;
#endif
        light = direct.light + packed_indirect::reflected_probes(r, eye, ray, params.behind_captured, sight);
#endif
    }
#ifdef FIRST_BOUNCE
#ifndef LIT_BEFORE
#ifdef SIGHT
    let sight = textureLoad(cube_sight, at, 0).x;
#else
    let sight = 0u;
#endif
    textureStore(cube_direct, at, vec4u(packed_light::pack(light, sight), 0u, 0u));
#endif
#endif
    return vec4f(light, select(1.0, 0.0, is_back(r.albedo, r.normal)));
}

/// Puts a lane's sums in a place.
fn spread(s: cube_sums::Sums, place: u32) {
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
    sums[(COUNT - 1u) * PLACES + place] = s.last;
#endif
#endif
}

/// A lane's sums and those in a place.
fn gathered(before: cube_sums::Sums, place: u32) -> cube_sums::Sums {
    var s = before;
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
    s.last += sums[(COUNT - 1u) * PLACES + place];
#endif
#endif
    return s;
}

fn four(first: u32, place: u32) -> mat4x4f {
    return mat4x4f(
        sums[first * PLACES + place],
        sums[(first + 1u) * PLACES + place],
        sums[(first + 2u) * PLACES + place],
        sums[(first + 3u) * PLACES + place],
    );
}

fn spread_four(m: mat4x4f, first: u32, place: u32) {
    sums[first * PLACES + place] = m[0];
    sums[(first + 1u) * PLACES + place] = m[1];
    sums[(first + 2u) * PLACES + place] = m[2];
    sums[(first + 3u) * PLACES + place] = m[3];
}

/// A texel of the packed probe, once `sums` holds all its coefficients.
fn packed_texel(texel: u32) -> vec4u {
    var largest = 0.0;
    for (var k = 0u; k < COUNT; k++) {
        let c = abs(sums[k].rgb);
        largest = max(largest, max(c.r, max(c.g, c.b)));
    }
    let scale = STEPS / max(largest, 1e-30);
    if texel == TEXELS - 1u {
        let last = select(vec3f(0.0), sums[COUNT - 1u].rgb, COUNT % 2u == 1u) * scale;
        let open = 2.0 * sums[0].a / probes::FULLY_OPEN - 1.0;
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

fn part(k: u32, channel: u32) -> f32 {
    return select(0.0, sums[min(k, COUNT - 1u)][channel], k < COUNT);
}

/// Two steps in a word, the lower half first.
fn two(a: f32, b: f32) -> u32 {
    return (u32(i32(round(a))) & 0xffffu) | (u32(i32(round(b))) << 16u);
}
