//! How much a bounce changed: the largest change of any coefficient over the largest coefficient (0, 0).
#import lightgraph::probes
#import lightgraph::sh::COUNT

struct Params {
    grid: vec3u,
}
var<uniform> params: Params;
var sh: texture_3d<f32>;
var sh_before: texture_3d<f32>;
var<storage, read_write> change: array<f32>;

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
        change[0] = largest[0].x / max(largest[0].y, 1e-30);
    }
}
