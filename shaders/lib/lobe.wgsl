//! Reflection of light from single directions, and directions drawn in proportion to it.
#define_import_path lightgraph::lobe
#import lightgraph::surface::Surface
#import lightgraph::gloss::matte
#ifdef SPECULAR
#import lightgraph::gloss::{draw_density, draw_lobe, glossy, lobe_share}
#endif
#import lightgraph::sampling::cosine_direction

/// The largest number below 1.
const BELOW_1: f32 = 0.99999994;

/// Radiance towards the viewer over radiance from the unit `direction`, times the cosine, in 1/sr: Lambert's
/// albedo/pi * cos(theta), and the lobes of `gloss`. Nothing comes from behind.
fn reflectance(s: Surface, direction: vec3f) -> vec3f {
    let sum = matte(s) * (max(dot(s.normal, direction), 0.0) / 3.14159265359);
#ifdef SPECULAR
    return sum + glossy(s, direction);
#else
    return sum;
#endif
}

/// A direction drawn about in proportion to `reflectance`, from a pair of numbers in 0..1. The first number chooses the
/// lobe, too: of a low-discrepancy sequence, each lobe then gets a part that is one as well.
fn scatter(s: Surface, u: vec2f) -> vec3f {
#ifdef SPECULAR
    let gloss = lobe_share(s);
    if u.x < gloss {
        return draw_lobe(s, vec2f(min(u.x / gloss, BELOW_1), u.y));
    }
    return cosine_direction(s.normal, vec2f(min((u.x - gloss) / (1.0 - gloss), BELOW_1), u.y));
#else
    return cosine_direction(s.normal, u);
#endif
}

/// The density with which `scatter` draws a direction on the normal's side, in 1/sr.
fn scatter_density(s: Surface, direction: vec3f) -> f32 {
    let density = max(dot(s.normal, direction), 0.0) / 3.14159265359;
#ifdef SPECULAR
    return mix(density, draw_density(s, direction), lobe_share(s));
#else
    return density;
#endif
}
