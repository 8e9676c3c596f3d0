//! Gathering light from probes weighed by whether they see the surface.
//!
//! PROBE_VISIBILITY says how a probe's view is known: 1 by its shadow cube map, 2 by moments of its distances.
#define_import_path lightgraph::visible_probes
#import lightgraph::sh::COUNT
#import lightgraph::probes
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
fn visible_share(c: probes::Cell, corner: u32, point: vec3f, normal: vec3f, behind: f32) -> f32 {
    let probe = probes::probe_at(c, corner);
    let offset = probes::position(probe) - point;
    let cosine = dot(offset, normal) * inverseSqrt(max(dot(offset, offset), 1e-12));
    let share = probes::share_of(c, corner) * max(cosine, behind);
    return select(0.0, share * visibility(probe, point, normal), share > 0.0);
}

/// Whether none of the eight probes round a point sees it.
fn is_lost(point: vec3f, normal: vec3f) -> bool {
    let here = probes::cell(point);
    var shares = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        shares += visible_share(here, corner, point, normal, 1.0);
    }
    return shares < NONE;
}

/// Whether none of the 64 probes round a point sees it, so that it gets no light.
fn is_blind(point: vec3f, normal: vec3f) -> bool {
    let here = probes::cell(point);
#if PROBE_VISIBILITY == 1
    return sight(here, point, normal) == 0u;
#else
    return is_lost(point, normal) && wide_share(here, point, normal) < NONE;
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
    point: vec3f,
    normal: vec3f,
    behind: f32,
) -> vec3f {
    let here = probes::cell(point);
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let probe = probes::probe_at(here, corner);
        var share = visible_share(here, corner, point, normal, behind);
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
        let found = nearest_visible(here, point, normal);
        if found == NOTHING {
            return vec3f(0.0);
        }
        return probes::weigh(coefficients, weights, probes::near_probe(here, found));
    }
#else
    if shares < ENOUGH {
        let wide = gather_wide(coefficients, weights, here, point, normal);
        sum += (ENOUGH - shares) * wide.rgb;
        shares += (ENOUGH - shares) * wide.a;
    }
#endif
    return sum / max(shares, NONE);
}

#if PROBE_VISIBILITY == 1
/// What sees a surface point. Bit i: corner i of its cell. Where none of the corners counts, bit 8: the others are the
/// number of the nearest probe that sees it, as `probes::near_probe` counts.
fn sight(here: probes::Cell, point: vec3f, normal: vec3f) -> u32 {
    // Those that the surface faces, first: only they need a look.
    var left = probes::corners_with_share(here);
    for (var corner = 0u; corner < 8u; corner++) {
        if !faces(probes::probe_at(here, corner), point, normal) {
            left &= ~(1u << corner);
        }
    }
    var seen = 0u;
    var shares = 0.0;
    while left != 0u {
        let corner = firstTrailingBit(left);
        if visibility(probes::probe_at(here, corner), point, normal) > 0.0 {
            seen |= 1u << corner;
            shares += probes::share_of(here, corner);
        }
        left &= left - 1u;
    }
    if shares < NONE {
        let found = nearest_visible(here, point, normal);
        return select(256u | found, 0u, found == NOTHING);
    }
    return seen;
}

const NOTHING: u32 = 64u;

/// The nearest probe that sees the point among the 4x4x4 round its cell, as `probes::near_probe` counts; `NOTHING` when
/// there is none.
fn nearest_visible(here: probes::Cell, point: vec3f, normal: vec3f) -> u32 {
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
            let offset = probes::position(probe) - point;
            far = dot(offset, offset);
            if (far < least || (far == least && number < best)) && faces(probe, point, normal) {
                i = number;
            }
            next++;
        }
        if i == NOTHING {
            break;
        }
        if visibility(probes::near_probe(here, i), point, normal) > 0.0 {
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
fn share_in_wide(here: probes::Cell, i: u32, point: vec3f, normal: vec3f) -> f32 {
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
    return near * visibility(vec3u(probe), point, normal);
}

/// The sum of their shares.
fn wide_share(here: probes::Cell, point: vec3f, normal: vec3f) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < 64u; i++) {
        sum += share_in_wide(here, i, point, normal);
    }
    return sum;
}

/// Light times shares, and the sum of the shares, of the 4x4x4 probes round a cell.
fn gather_wide(
    coefficients: texture_3d<f32>,
    weights: ptr<function, array<vec3f, COUNT>>,
    here: probes::Cell,
    point: vec3f,
    normal: vec3f,
) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < 64u; i++) {
        let probe = probes::near_probe(here, i);
        let share = share_in_wide(here, i, point, normal) * max(probes::open(coefficients, probe), CLOSED);
        if share > 0.0 {
            sum += share * vec4f(probes::weigh(coefficients, weights, probe), 1.0);
        }
    }
    return sum;
}
#endif
