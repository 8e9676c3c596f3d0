//! Light that a surface reflects from the probes round it.
#define_import_path lightgraph::indirect
#import lightgraph::surface::Surface
#ifdef PROBE_VISIBILITY
#import lightgraph::visible_probes::gather
#else
#import lightgraph::probes::gather
#endif
#import lightgraph::sh::COUNT
#ifdef LOBE_TABLE
#import lightgraph::lobe_table
#else
#import lightgraph::brdf::lambert_weights
#ifdef SPECULAR
#import lightgraph::brdf::phong_weights
#endif
#endif

/// Radiance that a surface reflects towards its viewer from light in spherical harmonics. May fall below 0 where a
/// truncated series rings; clamp what is shown, not what is summed on. `behind` is the weight of probes behind the
/// surface, as `gather` states it.
fn reflected_probes(coefficients: texture_3d<f32>, s: Surface, behind: f32) -> vec3f {
#ifdef LOBE_TABLE
    var weights: array<vec3f, COUNT>;
    lobe_table::weights(s, &weights);
#else
    var weights = reflection(s);
#endif
#ifdef PROBE_VISIBILITY
    return gather(coefficients, &weights, s, behind);
#else
    return gather(coefficients, &weights, s.position, s.normal, behind);
#endif
}

#ifndef LOBE_TABLE
/// Weights of the coefficients in the radiance that a surface reflects towards its viewer, matte and glossy together.
fn reflection(s: Surface) -> array<vec3f, COUNT> {
    var matte = lambert_weights(s.normal);
    var weights: array<vec3f, COUNT>;
#ifdef SPECULAR
    if s.specular > 0.0 {
        var glossy = phong_weights(reflect(-s.view, s.normal), s.shininess);
        for (var k = 0u; k < COUNT; k++) {
            weights[k] = vec3f(s.specular * glossy[k]);
        }
    }
#endif
    for (var k = 0u; k < COUNT; k++) {
        weights[k] += s.albedo * matte[k];
    }
    return weights;
}
#endif
