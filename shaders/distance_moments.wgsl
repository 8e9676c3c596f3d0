//! Mean and mean square of what a probe sees round each direction, weighed by a power of the cosine, in texels of an
//! unfolded octahedron (Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields",
//! 2019).
#import lightgraph::cube
#import lightgraph::octahedron
#import lightgraph::visibility_moments::reach

struct Params {
    probe_moments_tile: u32,
    probe_moments_columns: u32,
    probe_moments_count: u32,
    probe_distance_tile: u32,
    probe_distance_columns: u32,
    /// Exponent of the cosine.
    moment_sharpness: f32,
}
var<uniform> params: Params;
var probe_distance: texture_2d<f32>;
var probe_moments: texture_storage_2d<rg32float, write>;

@compute @workgroup_size(8, 8)
fn distance_moments(@builtin(global_invocation_id) id: vec3u) {
    let here = cube::place(id.xy, params.probe_moments_tile, params.probe_moments_columns);
    if any(id.xy >= textureDimensions(probe_moments)) || here.tile >= params.probe_moments_count {
        return;
    }
    let middle = octahedron::direction(here.texel, params.probe_moments_tile);
    let edge = params.probe_distance_tile;
    let far = reach();
    // Directions of less weight than a thousandth leave no trace. What does holds a texel at least, wherever it looks:
    // at the middle of a face, where texels are widest, the next one's centre is half a diagonal away.
    let next = 0.999 * inverseSqrt(1.0 + 2.0 / f32(edge * edge));
    let sharpness = min(params.moment_sharpness, log(0.001) / log(next));
    let least = pow(0.001, 1.0 / sharpness);
    var sum = vec3f(0.0);
    for (var i = 0u; i < 6u * edge * edge; i++) {
        let face = i / (edge * edge);
        let texel = vec2u(i % edge, i / edge % edge);
        let cosine = dot(cube::direction(face, texel, edge), middle);
        if cosine > least {
            let at = cube::unplace(here.tile * 6u + face, texel, edge, params.probe_distance_columns);
            let seen = textureLoad(probe_distance, at, 0).r;
            // Nothing counts as far away, the inside of a solid as no sight at all.
            let distance = select(clamp(seen, 0.0, far), far, seen == 0.0);
            let weight = pow(cosine, sharpness) * cube::solid_angle(texel, edge);
            sum += weight * vec3f(distance, distance * distance, 1.0);
        }
    }
    textureStore(probe_moments, id.xy, vec4f(sum.xy / sum.z, 0.0, 0.0));
}
