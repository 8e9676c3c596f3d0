//! How much a bounce changed: the largest change of any coefficient over the largest coefficient (0, 0). With
//! TRUSTED_END it is a bound of what all further bounces would change together: a bounce's change is at most g times
//! that of the one before it, so the rest of the series is at most change * (g + g^2 + ...) = change * g/(1 - g). For g
//! stands the largest ratio of two changes measured so far; it grows towards the true factor as the bounces go on.
#import lightgraph::probes
#import lightgraph::sh::COUNT

struct Params {
    grid: vec3u,
}
var<uniform> params: Params;
var sh: texture_3d<f32>;
var sh_before: texture_3d<f32>;
var<storage, read_write> change: array<f32>;
#ifdef TRUSTED_END
/// The loop's index.
var<uniform> bounce: u32;
struct Contraction {
    /// Largest change of the bounce before.
    change: f32,
    /// Largest ratio of two changes in a row.
    factor: f32,
}
var<storage, read_write> contraction: Contraction;

/// Larger than any relative change: the loop goes on.
const UNKNOWN: f32 = 1e30;

/// Bound of all further changes after a bounce that changed so much.
fn rest(largest_change: f32) -> f32 {
    let before = contraction.change;
    contraction.change = largest_change;
    if largest_change == 0.0 {
        return 0.0;
    }
    if bounce == 0u {
        contraction.factor = 0.0;
        return UNKNOWN;
    }
    let factor = max(contraction.factor, largest_change / before);
    contraction.factor = factor;
    return select(UNKNOWN, largest_change * factor / (1.0 - factor), factor < 1.0);
}
#else
fn rest(largest_change: f32) -> f32 {
    return largest_change;
}
#endif

const LANES: u32 = 128u;
/// Largest change and largest coefficient (0, 0) that each lane met.
var<workgroup> largest: array<vec2f, LANES>;

fn brightest(v: vec4f) -> f32 {
    return max(max(abs(v.r), abs(v.g)), abs(v.b));
}

/// One workgroup: a maximum doesn't depend on the order, so the result is the same in every run.
@compute @workgroup_size(LANES)
fn measure(@builtin(local_invocation_index) lane: u32) {
    var found = vec2f(0.0);
    let texels = params.grid.x * params.grid.y * params.grid.z * COUNT;
    for (var i = lane; i < texels; i += LANES) {
        let at = probes::coordinates(i);
        let now = textureLoad(sh, at, 0);
        let constant = select(0.0, brightest(now), at.z < params.grid.z);
        found = max(found, vec2f(brightest(now - textureLoad(sh_before, at, 0)), constant));
    }
    largest[lane] = found;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            largest[lane] = max(largest[lane], largest[lane + half]);
        }
    }
    if lane == 0u {
        change[0] = rest(largest[0].x) / max(largest[0].y, 1e-30);
    }
}
