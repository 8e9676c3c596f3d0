//! The coefficients of probes packed for few fetches: 16 bits each, as parts of the probe's largest. The error is
//! 1.5e-5 of that one at most, so that bright scenes keep their limit where half floats would miss it.
//!
//! A probe is TEXELS texels along x of an image, those of one x, y, z of the grid at (x * TEXELS, z * grid.y + y).
//! Three hold the red, green and blue of eight coefficients, two to a word, the lower first; the last holds what is
//! left: coefficient COUNT - 1 where COUNT is odd, how open the probe is, and what a step of all these numbers stands
//! for.
//!
//! PACKED_PROBES says whose light is meant: 1 that of the probes now, 2 of those a bounce before, 3 the former less the
//! latter.
#define_import_path lightgraph::packed_probes
#import lightgraph::probes
#import lightgraph::sh::{COUNT, ORDER, basis}

const EIGHTS: u32 = (COUNT + 4u) / 8u;
const TEXELS: u32 = 3u * EIGHTS + 1u;

/// Steps from 0 to the largest coefficient. Values stay in the upper halves of words: 65536 to a step.
const STEPS: f32 = 32767.0;

#if PACKED_PROBES != 2
var packed: texture_storage_2d<rgba32uint, read>;

fn texel_now(probe: vec3u, i: u32) -> vec4u {
    return textureLoad(packed, packed_place(probe) + vec2u(i, 0u));
}
#endif

#if PACKED_PROBES >= 2
var packed_before: texture_storage_2d<rgba32uint, read>;

fn texel_before(probe: vec3u, i: u32) -> vec4u {
    return textureLoad(packed_before, packed_place(probe) + vec2u(i, 0u));
}
#endif

/// Where a probe's texels begin.
fn packed_place(probe: vec3u) -> vec2u {
    return vec2u(probe.x * TEXELS, probe.z * probes::probe_grid.grid.y + probe.y);
}

/// Texel `i` of a probe; `before` is asked for only where both bounces are there.
fn texel_of(probe: vec3u, i: u32, before: bool) -> vec4u {
#if PACKED_PROBES == 1
    return texel_now(probe, i);
#endif
#if PACKED_PROBES == 2
    return texel_before(probe, i);
#endif
#if PACKED_PROBES == 3
    if before {
        return texel_before(probe, i);
    }
    return texel_now(probe, i);
#endif
}

/// A weight for each coefficient: of eight those with even numbers, then those with odd ones.
struct Weights {
#if SH_ORDER >= 1
    even0: vec4f,
    odd0: vec4f,
#endif
#if SH_ORDER >= 3
    even1: vec4f,
    odd1: vec4f,
#endif
#if SH_ORDER >= 4
    even2: vec4f,
    odd2: vec4f,
#endif
    last: f32,
}

/// The weights in the radiance that a Lambert surface of albedo 1 reflects, as `lightgraph::brdf` derives them, without
/// its loops.
fn lambert(normal: vec3f) -> Weights {
    let y = basis(normal);
    var w: Weights;
#if SH_ORDER == 0
    w.last = y[0];
#else
    let third = 2.0 / 3.0;
#endif
#if SH_ORDER == 1
    w.even0 = vec4f(y[0], third * y[2], 0.0, 0.0);
    w.odd0 = vec4f(third * y[1], third * y[3], 0.0, 0.0);
#endif
#if SH_ORDER >= 2
    w.even0 = vec4f(y[0], third * y[2], 0.25 * y[4], 0.25 * y[6]);
    w.odd0 = vec4f(third * y[1], third * y[3], 0.25 * y[5], 0.25 * y[7]);
#endif
#if SH_ORDER == 2
    w.last = 0.25 * y[8];
#endif
#if SH_ORDER >= 3
    // Degree 3 weighs nothing.
    w.even1 = vec4f(0.25 * y[8], 0.0, 0.0, 0.0);
#endif
#if SH_ORDER >= 4
    let fourth = -1.0 / 24.0;
    w.even2 = fourth * vec4f(y[16], y[18], y[20], y[22]);
    w.odd2 = fourth * vec4f(y[17], y[19], y[21], y[23]);
    w.last = fourth * y[24];
#endif
    return w;
}

/// Any weights.
fn weights(w: array<f32, COUNT>) -> Weights {
    var all: Weights;
#if SH_ORDER == 0
    all.last = w[0];
#endif
#if SH_ORDER == 1
    all.even0 = vec4f(w[0], w[2], 0.0, 0.0);
    all.odd0 = vec4f(w[1], w[3], 0.0, 0.0);
#endif
#if SH_ORDER >= 2
    all.even0 = vec4f(w[0], w[2], w[4], w[6]);
    all.odd0 = vec4f(w[1], w[3], w[5], w[7]);
#endif
#if SH_ORDER == 2
    all.last = w[8];
#endif
#if SH_ORDER >= 3
    all.even1 = vec4f(w[8], w[10], w[12], w[14]);
    all.odd1 = vec4f(w[9], w[11], w[13], w[15]);
#endif
#if SH_ORDER >= 4
    all.even2 = vec4f(w[16], w[18], w[20], w[22]);
    all.odd2 = vec4f(w[17], w[19], w[21], w[23]);
    all.last = w[24];
#endif
    return all;
}

fn lower(words: vec4u) -> vec4f {
    return vec4f(bitcast<vec4i>(words << vec4u(16u)));
}

fn upper(words: vec4u) -> vec4f {
    return vec4f(bitcast<vec4i>(words & vec4u(0xffff0000u)));
}

/// Red, green and blue of eight coefficients, from texel `first` on, weighed.
fn eight(probe: vec3u, first: u32, before: bool, even: vec4f, odd: vec4f) -> vec3f {
    let red = texel_of(probe, first, before);
    let green = texel_of(probe, first + 1u, before);
    let blue = texel_of(probe, first + 2u, before);
    return vec3f(
        dot(lower(red), even) + dot(upper(red), odd),
        dot(lower(green), even) + dot(upper(green), odd),
        dot(lower(blue), even) + dot(upper(blue), odd),
    );
}

/// A weighed probe.
struct Weighed {
    light: vec3f,
    /// 1 for no backs in sight, 0 for half of all directions.
    open: f32,
}

/// Sum over the coefficients of `w` times one probe's.
fn weigh(w: Weights, probe: vec3u) -> Weighed {
    var found = weigh_one(w, probe, false);
#if PACKED_PROBES == 3
    found.light -= weigh_one(w, probe, true).light;
#endif
    return found;
}

fn weigh_one(w: Weights, probe: vec3u, before: bool) -> Weighed {
    let rest = texel_of(probe, TEXELS - 1u, before);
    let low = lower(rest);
    let high = upper(rest);
    var sum = w.last * vec3f(low.x, high.x, low.y);
#if SH_ORDER >= 1
    sum += eight(probe, 0u, before, w.even0, w.odd0);
#endif
#if SH_ORDER >= 3
    sum += eight(probe, 3u, before, w.even1, w.odd1);
#endif
#if SH_ORDER >= 4
    sum += eight(probe, 6u, before, w.even2, w.odd2);
#endif
    return Weighed(bitcast<f32>(rest.z) * sum, high.y / (65536.0 * STEPS));
}
