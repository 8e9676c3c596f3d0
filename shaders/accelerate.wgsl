//! Anderson acceleration of the bounces (Walker and Ni, "Anderson Acceleration for Fixed-Point Iterations", 2011): of
//! the last few bounces' results, the mixture whose change would be least.
//!
//! With x the coefficients before a bounce, g those after it and f = g - x, it finds the factors c_j that minimise
//! |f - sum c_j (f - f_j)| over earlier bounces j, and puts g - sum c_j (g - g_j) in place of g. Colour channels don't
//! mix in a bounce, so each has factors of its own.
#import lightgraph::probes
#import lightgraph::sh::COUNT

struct Params {
    grid: vec3u,
    /// The loop's index.
    bounce: u32,
}
var<uniform> params: Params;
var sh: texture_3d<f32>;
var sh_before: texture_3d<f32>;
var sh_mixed: texture_storage_3d<rgba32float, write>;
/// g and f of the last bounces, a slot a bounce.
var<storage, read_write> earlier_results: array<vec4f>;
var<storage, read_write> earlier_changes: array<vec4f>;

const LANES: u32 = 128u;
const MEMORY: u32 = #{MEMORY}u;
/// Upper triangle of the products of differences, row by row, then their products with f.
const SUMS: u32 = MEMORY * (MEMORY + 1u) / 2u + MEMORY;
/// A difference whose part that is new has less than this share of its square is left out: about what rounding of
/// sums of f32 leaves of its digits.
const NEW: f32 = 1e-5;

var<workgroup> partial: array<vec3f, LANES>;
var<workgroup> sums: array<vec3f, SUMS>;
var<workgroup> factors: array<vec3f, MEMORY>;

fn row(i: u32, j: u32) -> u32 {
    return i * MEMORY - i * (i + 1u) / 2u + j;
}

/// Solves the normal equations by Cholesky's method without roots, all channels at once; for slots 0 to `known` - 1.
fn solve(known: u32) {
    var lower: array<array<vec3f, MEMORY>, MEMORY>;
    var pivot: array<vec3f, MEMORY>;
    var inverse: array<vec3f, MEMORY>;
    var c: array<vec3f, MEMORY>;
    for (var j = 0u; j < known; j++) {
        var d = sums[row(j, j)];
        var right = sums[row(MEMORY - 1u, MEMORY - 1u) + 1u + j];
        for (var k = 0u; k < j; k++) {
            d -= lower[j][k] * lower[j][k] * pivot[k];
            right -= lower[j][k] * c[k];
        }
        let holds = d > max(NEW * sums[row(j, j)], vec3f(1e-30));
        pivot[j] = select(vec3f(0.0), d, holds);
        inverse[j] = select(vec3f(0.0), 1.0 / max(d, vec3f(1e-30)), holds);
        c[j] = right;
        for (var i = j + 1u; i < known; i++) {
            var a = sums[row(j, i)];
            for (var k = 0u; k < j; k++) {
                a -= lower[i][k] * lower[j][k] * pivot[k];
            }
            lower[i][j] = a * inverse[j];
        }
    }
    for (var n = known; n > 0u; n--) {
        let j = n - 1u;
        var value = c[j] * inverse[j];
        for (var i = j + 1u; i < known; i++) {
            value -= lower[i][j] * factors[i];
        }
        factors[j] = select(vec3f(0.0), value, inverse[j] > vec3f(0.0));
    }
}

/// One workgroup: sums in a fixed order, so every run gives the same bits.
@compute @workgroup_size(LANES)
fn accelerate(@builtin(local_invocation_index) lane: u32) {
    let texels = params.grid.x * params.grid.y * params.grid.z * COUNT;
    let known = min(params.bounce, MEMORY);
    var mine: array<vec3f, SUMS>;
    for (var t = lane; t < texels; t += LANES) {
        let at = probes::coordinates(t);
        let f = textureLoad(sh, at, 0).rgb - textureLoad(sh_before, at, 0).rgb;
        var difference: array<vec3f, MEMORY>;
        for (var j = 0u; j < known; j++) {
            difference[j] = f - earlier_changes[j * texels + t].rgb;
        }
        for (var j = 0u; j < known; j++) {
            for (var i = j; i < known; i++) {
                mine[row(j, i)] += difference[j] * difference[i];
            }
            mine[row(MEMORY - 1u, MEMORY - 1u) + 1u + j] += difference[j] * f;
        }
    }
    for (var s = 0u; s < SUMS; s++) {
        partial[lane] = mine[s];
        for (var half = LANES / 2u; half > 0u; half /= 2u) {
            workgroupBarrier();
            if lane < half {
                partial[lane] += partial[lane + half];
            }
        }
        workgroupBarrier();
        if lane == 0u {
            sums[s] = partial[0];
        }
        workgroupBarrier();
    }
    if lane == 0u {
        solve(known);
    }
    workgroupBarrier();
    let slot = params.bounce % MEMORY;
    for (var t = lane; t < texels; t += LANES) {
        let at = probes::coordinates(t);
        let g = textureLoad(sh, at, 0);
        let f = g - textureLoad(sh_before, at, 0);
        var mixed = g.rgb;
        for (var j = 0u; j < known; j++) {
            mixed -= factors[j] * (g.rgb - earlier_results[j * texels + t].rgb);
        }
        textureStore(sh_mixed, at, vec4f(mixed, g.a));
        earlier_results[slot * texels + t] = g;
        earlier_changes[slot * texels + t] = f;
    }
}
