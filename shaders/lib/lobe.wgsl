//! Reflection of light from single directions; `scatter` and its density are those of Lambert's and Phong's lobes.
#define_import_path lightgraph::lobe
#import lightgraph::surface::Surface
#import lightgraph::gloss::{lobes, matte, tints}
#import lightgraph::sampling::{cosine_direction, lobe_direction}

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

/// How often `scatter` takes the Phong lobe.
fn gloss_share(s: Surface) -> f32 {
#ifdef SPECULAR
    let diffuse = max(max(s.albedo.r, s.albedo.g), s.albedo.b);
    return select(0.0, s.specular / (s.specular + diffuse), s.specular > 0.0);
#else
    return 0.0;
#endif
}

/// A direction drawn in proportion to the two lobes, from a number that chooses one and a pair for it.
fn scatter(s: Surface, choice: f32, u: vec2f) -> vec3f {
    if choice < gloss_share(s) {
        return lobe_direction(reflect(-s.view, s.normal), s.shininess, u);
    }
    return cosine_direction(s.normal, u);
}

/// The density with which `scatter` draws a direction on the normal's side, in 1/sr.
fn scatter_density(s: Surface, direction: vec3f) -> f32 {
    let cosine = max(dot(s.normal, direction), 0.0);
#ifdef SPECULAR
    return mix(cosine / 3.14159265359, lobes(s, direction).x, gloss_share(s));
#else
    return cosine / 3.14159265359;
#endif
}
