//! Reflection of light from single directions, and directions drawn in proportion to it.
#define_import_path lightgraph::lobe
#import lightgraph::surface::Surface
#import lightgraph::gloss::{lobes, matte, tints, lobe_share, draw_lobe, draw_density}
#import lightgraph::sampling::cosine_direction
#ifdef COATS
#import lightgraph::metallic_roughness
#endif

/// The largest number below 1.
const BELOW_1: f32 = 0.99999994;

/// Radiance towards the viewer over radiance from the unit `direction`, times the cosine, in 1/sr: Lambert's
/// albedo/pi * cos(theta), and the lobes of `gloss`. Nothing comes from behind.
fn reflectance(s: Surface, direction: vec3f) -> vec3f {
#ifdef COATS
    let share = coat_share(s);
    return (1.0 - share) * below(s, direction) + vec3f(share * coat_lobe(s, direction));
}

/// Share of light that the clear layer reflects: of an ior of 1.5 (KHR_materials_clearcoat, "Layering").
fn coat_share(s: Surface) -> f32 {
    return s.coat.x * (0.04 + 0.96 * pow(clamp(1.0 - abs(dot(s.coat_normal, s.view)), 0.0, 1.0), 5.0));
}

/// A surface as its clear layer is.
fn coat_of(s: Surface) -> Surface {
    var coat = s;
    coat.normal = s.coat_normal;
    coat.roughness = s.coat.y;
    return coat;
}

fn coat_lobe(s: Surface, direction: vec3f) -> f32 {
    return select(0.0, metallic_roughness::lobes(coat_of(s), direction).x, dot(s.coat_normal, direction) > 0.0);
}

/// `reflectance` below the clear layer.
fn below(s: Surface, direction: vec3f) -> vec3f {
#endif
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

/// A direction drawn about in proportion to `reflectance`, from a pair of numbers in 0..1. The first number chooses the
/// lobe, too: of a low-discrepancy sequence, each lobe then gets a part that is one as well.
fn scatter(s: Surface, u: vec2f) -> vec3f {
#ifdef COATS
    let share = coat_share(s);
    if u.x < share {
        return metallic_roughness::draw_lobe(coat_of(s), vec2f(min(u.x / share, BELOW_1), u.y));
    }
    return scatter_below(s, vec2f(min((u.x - share) / (1.0 - share), BELOW_1), u.y));
}

fn scatter_below(s: Surface, u: vec2f) -> vec3f {
#endif
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
#ifdef COATS
    var coat = 0.0;
    if dot(s.coat_normal, direction) > 0.0 {
        coat = metallic_roughness::draw_density(coat_of(s), direction);
    }
    return mix(density_below(s, direction), coat, coat_share(s));
}

fn density_below(s: Surface, direction: vec3f) -> f32 {
#endif
    let cosine = max(dot(s.normal, direction), 0.0);
    var density = cosine / 3.14159265359;
#ifdef SPECULAR
    if cosine > 0.0 {
        density = mix(density, draw_density(s, direction), lobe_share(s));
    }
#endif
    return density;
}
