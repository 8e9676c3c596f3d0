//! Light that a surface reflects from the probes round it.
#define_import_path lightgraph::indirect
#import lightgraph::surface::Surface
#ifdef PROBE_VISIBILITY
#import lightgraph::visible_probes::gather
#else
#import lightgraph::probes::gather
#endif
#import lightgraph::brdf::lambert_weights
#ifdef LOBE_TABLE
#import lightgraph::gloss
#import lightgraph::lobe_table
#import lightgraph::sh::COUNT
#else ifdef SPECULAR
#import lightgraph::brdf::phong_weights
#endif

/// Radiance that a surface reflects towards its viewer from light in spherical harmonics. May fall below 0 where a
/// truncated series rings; clamp what is shown, not what is summed on. `behind` is the weight of probes behind the
/// surface, as `gather` states it.
fn reflected_probes(coefficients: texture_3d<f32>, s: Surface, behind: f32) -> vec3f {
#ifdef LOBE_TABLE
    var sum = gloss::matte(s) * gather(coefficients, lambert_weights(s.normal), s.position, s.normal, behind);
    let tints = gloss::tints(s);
    if any(tints[0] != vec3f(0.0)) {
        var lobes = lobe_table::weights(s);
        for (var i = 0u; i < gloss::LOBES; i++) {
            var weights: array<f32, COUNT>;
            for (var k = 0u; k < COUNT; k++) {
                weights[k] = lobes[k][i];
            }
            sum += tints[i] * gather(coefficients, weights, s.position, s.normal, behind);
        }
    }
#else
    var sum = s.albedo * gather(coefficients, lambert_weights(s.normal), s.position, s.normal, behind);
#ifdef SPECULAR
    if s.specular > 0.0 {
        let weights = phong_weights(reflect(-s.view, s.normal), s.shininess);
        sum += s.specular * gather(coefficients, weights, s.position, s.normal, behind);
    }
#endif
#endif
    return sum;
}
