//! Reflection of light from single directions, and directions drawn in proportion to it.
#define_import_path lightgraph::lobe
#import lightgraph::surface::Surface
#import lightgraph::gloss::{lobes, matte, tints, lobe_share, draw_lobe, draw_density}
#import lightgraph::sampling::cosine_direction

/// Radiance towards the viewer over radiance from the unit `direction`, times the cosine, in 1/sr: Lambert's
/// albedo/pi * cos(theta), and the lobes of `gloss`. Nothing comes from behind.
fn reflectance(s: Surface, direction: vec3f) -> vec3f {
    let cosine = dot(s.normal, direction);
    if cosine <= 0.0 {
        return vec3f(0.0);
    }
    var sum = matte(s) * (cosine / 3.14159265359);
#ifdef SPECULAR
    sum += tints(s) * lobes(s, direction);
#endif
    return sum;
}

/// A direction drawn about in proportion to `reflectance`, from a number that chooses between Lambert's lobe and the
/// surface's own, and a pair for it.
fn scatter(s: Surface, choice: f32, u: vec2f) -> vec3f {
#ifdef SPECULAR
    if choice < lobe_share(s) {
        return draw_lobe(s, u);
    }
#endif
    return cosine_direction(s.normal, u);
}

/// The density with which `scatter` draws a direction on the normal's side, in 1/sr.
fn scatter_density(s: Surface, direction: vec3f) -> f32 {
    let cosine = max(dot(s.normal, direction), 0.0);
    var density = cosine / 3.14159265359;
#ifdef SPECULAR
    if cosine > 0.0 {
        density = mix(density, draw_density(s, direction), lobe_share(s));
    }
#endif
    return density;
}
