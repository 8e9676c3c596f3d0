//! Gathering light from probes weighed by whether they see the surface.
//!
//! PROBE_VISIBILITY says how a probe's view is known: 1 by its shadow cube map, 2 by moments of its distances.
#define_import_path lightgraph::visible_probes
#import lightgraph::sh::COUNT
#import lightgraph::probes
#import lightgraph::surface::Surface
#if PROBE_VISIBILITY == 1
#import lightgraph::visibility_cube::{faces, visibility}
#else
#import lightgraph::visibility_moments::visibility
#endif

/// Shares below this, of the eight probes together, count as none.
const NONE: f32 = 1e-6;

/// What a probe that stands in a solid, or outside, counts: to soft views it sees the far side of the walls near it.
const CLOSED: f32 = 1e-3;

/// The share of a cell's corner: trilinear, by visibility, and by the cosine between the normal and the direction to
/// the probe, at least `behind`.
fn visible_share(c: probes::Cell, corner: u32, s: Surface, behind: f32) -> f32 {
    let probe = probes::probe_at(c, corner);
    let offset = probes::position(probe) - s.position;
    let cosine = dot(offset, s.normal) * inverseSqrt(max(dot(offset, offset), 1e-12));
    let share = probes::share_of(c, corner) * max(cosine, behind);
    return select(0.0, share * visibility(probe, s), share > 0.0);
}

/// Whether none of the eight probes round a point sees it.
fn is_lost(s: Surface) -> bool {
    let here = probes::cell(s.position);
    var shares = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        shares += visible_share(here, corner, s, 1.0);
    }
    return shares < NONE;
}

/// Whether none of the 64 probes round a point sees it, so that it gets no light.
fn is_blind(s: Surface) -> bool {
    let here = probes::cell(s.position);
#if PROBE_VISIBILITY == 1
    return sight(here, s) == 0u;
#else
    return is_lost(s) && wide_share(here, s) < NONE;
#endif
}

/// Sum over the coefficients of `weights` times their interpolation at a surface point in the world, from those of
/// the eight probes round it that see it.
///
/// Where none does, 0/1 views take the nearest probe that sees it among the 64 round it. Soft views take all of those
/// the more, the less of the eight is seen: a quotient of shares that vanish together would jump from cell to cell.
/// Without a probe in sight no light comes.
fn gather(
    coefficients: texture_3d<f32>,
    weights: ptr<function, array<vec3f, COUNT>>,
    s: Surface,
    behind: f32,
) -> vec3f {
    let here = probes::cell(s.position);
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let probe = probes::probe_at(here, corner);
        var share = visible_share(here, corner, s, behind);
#if PROBE_VISIBILITY == 2
        share *= max(probes::open(coefficients, probe), CLOSED);
#endif
        if share > 0.0 {
            sum += share * probes::weigh(coefficients, weights, probe);
            shares += share;
        }
    }
#if PROBE_VISIBILITY == 1
    if shares < NONE {
        let found = nearest_visible(here, s);
        if found == NOTHING {
            return vec3f(0.0);
        }
        return probes::weigh(coefficients, weights, probes::near_probe(here, found));
    }
#else
    if shares < ENOUGH {
        let wide = gather_wide(coefficients, weights, here, s);
        sum += (ENOUGH - shares) * wide.rgb;
        shares += (ENOUGH - shares) * wide.a;
    }
#endif
    return sum / max(shares, NONE);
}

#if PROBE_VISIBILITY == 1
/// What sees a surface point. Bit i: corner i of its cell. Where none of the corners counts, bit 8: the others are the
/// number of the nearest probe that sees it, as `probes::near_probe` counts.
fn sight(here: probes::Cell, s: Surface) -> u32 {
    // Those that the surface faces, first: only they need a look.
    var left = probes::corners_with_share(here);
    for (var corner = 0u; corner < 8u; corner++) {
        if !faces(probes::probe_at(here, corner), s) {
            left &= ~(1u << corner);
        }
    }
    var seen = 0u;
    var shares = 0.0;
    while left != 0u {
        let corner = firstTrailingBit(left);
        if visibility(probes::probe_at(here, corner), s) > 0.0 {
            seen |= 1u << corner;
            shares += probes::share_of(here, corner);
        }
        left &= left - 1u;
    }
    if shares < NONE {
        let found = nearest_visible(here, s);
        return select(256u | found, 0u, found == NOTHING);
    }
    return seen;
}

const NOTHING: u32 = 64u;

/// The nearest probe that sees the point among the 4x4x4 round its cell, as `probes::near_probe` counts; `NOTHING` when
/// there is none.
fn nearest_visible(here: probes::Cell, s: Surface) -> u32 {
    var best = NOTHING;
    var least = 3.4e38;
    var next = 0u;
    loop {
        // On to one that may be it, which costs little beside a look.
        var far = 0.0;
        var i = NOTHING;
        while next < 64u && i == NOTHING {
            // The corners of the cell come first: what lies beyond them seldom matters then.
            let inner = vec3u(next, next >> 1u, next >> 2u) & vec3u(1u);
            let outer = vec3u(next >> 3u, next >> 4u, next >> 5u) & vec3u(1u);
            let place = select(inner + 1u, 3u * inner, outer == vec3u(1u));
            let number = place.x + 4u * place.y + 16u * place.z;
            let probe = probes::near_probe(here, number);
            let offset = probes::position(probe) - s.position;
            far = dot(offset, offset);
            if (far < least || (far == least && number < best)) && faces(probe, s) {
                i = number;
            }
            next++;
        }
        if i == NOTHING {
            break;
        }
        if visibility(probes::near_probe(here, i), s) > 0.0 {
            least = far;
            best = i;
        }
    }
    return best;
}
#else
/// Shares of the eight probes that need no others beside them.
const ENOUGH: f32 = 0.5;

/// The share of the probe `step` of -1, 0, 1, 2 beyond the lower one, `fraction` from there to the upper one: the
/// cubic B-spline, which is smooth from cell to cell.
fn spline(step: i32, fraction: f32) -> f32 {
    let far = abs(f32(step) - fraction);
    let rest = 2.0 - far;
    return select(rest * rest * rest / 6.0, 2.0 / 3.0 - 0.5 * far * far * rest, far < 1.0);
}

/// The share of the probe number `i` of the 4x4x4 round a cell.
fn share_in_wide(here: probes::Cell, i: u32, s: Surface) -> f32 {
    let step = vec3i(vec3u(i, i >> 2u, i >> 4u) & vec3u(3u)) - 1;
    let probe = vec3i(here.base) + step;
    if any(probe < vec3i(0)) || any(probe >= vec3i(probes::probe_grid.grid)) {
        return 0.0;
    }
    let f = here.fraction;
    let near = spline(step.x, f.x) * spline(step.y, f.y) * spline(step.z, f.z);
    if near <= 0.0 {
        return 0.0;
    }
    return near * visibility(vec3u(probe), s);
}

/// The sum of their shares.
fn wide_share(here: probes::Cell, s: Surface) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < 64u; i++) {
        sum += share_in_wide(here, i, s);
    }
    return sum;
}

/// Light times shares, and the sum of the shares, of the 4x4x4 probes round a cell.
fn gather_wide(
    coefficients: texture_3d<f32>,
    weights: ptr<function, array<vec3f, COUNT>>,
    here: probes::Cell,
    s: Surface,
) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < 64u; i++) {
        let probe = probes::near_probe(here, i);
        let share = share_in_wide(here, i, s) * max(probes::open(coefficients, probe), CLOSED);
        if share > 0.0 {
            sum += share * vec4f(probes::weigh(coefficients, weights, probe), 1.0);
        }
    }
    return sum;
}
#endif
