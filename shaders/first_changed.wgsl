//! Which probes have another first bounce than in the last frame, a bit each: of those that ran, some come out as they
//! were.
var<storage, read> first_dirty: array<u32>;
var first_sh: texture_3d<f32>;
var first_sh_before: texture_3d<f32>;
var<storage, read_write> first_changed: array<u32>;
/// Probes along x, y, z.
var<uniform> grid: vec3u;

/// Whether a probe's coefficients differ in any bit.
fn differs(probe: u32) -> bool {
    let at = vec3u(probe % grid.x, probe / grid.x % grid.y, probe / (grid.x * grid.y));
    for (var z = at.z; z < textureDimensions(first_sh).z; z += grid.z) {
        let now = bitcast<vec4u>(textureLoad(first_sh, vec3u(at.xy, z), 0));
        let before = bitcast<vec4u>(textureLoad(first_sh_before, vec3u(at.xy, z), 0));
        if any(now != before) {
            return true;
        }
    }
    return false;
}

/// A lane a word.
@compute @workgroup_size(64)
fn first_changed_words(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&first_changed) {
        return;
    }
    var left = first_dirty[id.x];
    var word = 0u;
    while left != 0u {
        let bit = firstTrailingBit(left);
        left &= left - 1u;
        let probe = 32u * id.x + bit;
        if probe < grid.x * grid.y * grid.z && differs(probe) {
            word |= 1u << bit;
        }
    }
    first_changed[id.x] = word;
}
