//! Light that comes to the cells straight from emitters, or from the environment: irradiance over pi, the mean over the
//! places that their rays leave. In alpha, summed over the channels: half of what every other ray tells beyond the
//! rest.
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell}
#import lightgraph::packed_light

/// See cell_looks.wgsl and cell_sky.wgsl.
var<storage, read> link_emission: array<vec2u>;
var<storage, read_write> emitted: array<vec4f>;

@compute @workgroup_size(64)
fn cell_emission(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x;
    if key_of_cell(cell) == NO_KEY {
        return;
    }
    var sum = vec3f(0.0);
    var halves = vec2f(0.0);
    for (var i = 0u; i < LINKS; i++) {
        let light = packed_light::unpack(link_emission[cell * LINKS + i]);
        sum += light;
        halves[i % 2u] += dot(light, vec3f(1.0));
    }
    let means = halves / vec2f(f32((LINKS + 1u) / 2u), f32(max(LINKS / 2u, 1u)));
    emitted[cell] = vec4f(sum / f32(LINKS), select(0.0, 0.5 * (means.x - means.y), LINKS > 1u));
}
