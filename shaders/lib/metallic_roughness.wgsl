//! glTF's metallic-roughness model as lobes of `gloss`: GGX, Smith's shadowing, Schlick's Fresnel term.
//!
//! Metals reflect with the base colour. What is no metal is matte. With FACES, materials that state what their face
//! does reflect there, too. With DIELECTRICS all do.
#define_import_path lightgraph::metallic_roughness
#import lightgraph::surface::Surface
#import lightgraph::microfacets::{facets, unshadowed, draw_facet, reflected_shares}

#ifdef DIELECTRICS
/// Reflectance of what is no metal, seen head on and at grazing angles.
const DIELECTRIC: vec2f = vec2f(0.04, 1.0);
#else
const DIELECTRIC: vec2f = vec2f(0.0);
#endif
/// Least width of the distribution of facets, which numbers of 32 bits still hold: a mirror to a ninth of a degree.
const SHARPEST: f32 = 0.001;
/// Least cosine to the viewer.
const GRAZING: f32 = 1e-4;

fn facet_width(s: Surface) -> f32 {
    return max(s.roughness * s.roughness, SHARPEST);
}

/// The direction to the viewer, lifted above the surface where an interpolated normal turns away from who sees it.
fn view_above(s: Surface) -> vec3f {
    return normalize(s.view + max(GRAZING - dot(s.normal, s.view), 0.0) * s.normal);
}

#ifdef FACES
/// What a face reflects head on, of the channel of which it does most: as much is lost to what lies below it.
fn most(s: Surface) -> f32 {
    return max(max(s.face.r, s.face.g), s.face.b);
}
#endif

/// Of what is no metal, what the lobe does not reflect.
fn matte(s: Surface) -> vec3f {
#ifdef FACES
    var below = (1.0 - s.metallic) * s.albedo;
#ifdef CLEAR
    below *= 1.0 - s.transmission;
#endif
    return (1.0 - most(s)) * below;
#else
    return (1.0 - s.metallic) * (1.0 - DIELECTRIC.x) * s.albedo;
#endif
}

/// Reflectance head on for the first lobe, what it grows by towards grazing for the second; the third is what the
/// second takes from the matte share.
fn tints(s: Surface) -> mat3x3f {
#ifdef FACES
    let tint = mix(s.face.rgb, s.albedo, s.metallic);
    let edge = mix(s.face.w, 1.0, s.metallic);
    let lost = (s.face.w - most(s)) / max(1.0 - most(s), 1e-6);
    return mat3x3f(tint, vec3f(edge) - tint, -lost * matte(s));
#else
    let head_on = mix(vec3f(DIELECTRIC.x), s.albedo, s.metallic);
    let grazing = mix(DIELECTRIC.y, 1.0, s.metallic);
    return mat3x3f(head_on, grazing - head_on, -DIELECTRIC.y * matte(s));
#endif
}

/// What is reflected of light from all around, by `microfacets::powers` of the cosine to the viewer.
fn reflected_evenly(s: Surface, powers: vec4f) -> vec3f {
    return matte(s) + tints(s) * reflected_shares(s.roughness, powers);
}

/// The lobe as if facets reflected all; times Schlick's (1 - cos)^5; and a matte surface times that.
fn lobes(s: Surface, direction: vec3f) -> vec3f {
    let incoming = dot(s.normal, direction);
    let edge = pow(clamp(1.0 - dot(direction, normalize(direction + view_above(s))), 0.0, 1.0), 5.0);
    let lobe = draw_density(s, direction) * unshadowed(incoming, facet_width(s));
    return vec3f(lobe, lobe * edge, edge * incoming / 3.14159265359);
}

/// The lobe's share of what the surface reflects towards the viewer, about.
fn lobe_share(s: Surface) -> f32 {
    let parts = tints(s);
    let edge = pow(clamp(1.0 - dot(s.normal, s.view), 0.0, 1.0), 5.0);
    let gloss = dot(parts[0] + edge * parts[1], vec3f(1.0));
    return gloss / max(gloss + dot(matte(s), vec3f(1.0)), 1e-20);
}

/// A direction drawn from the lobe, but for what hides its facets from it; it may lie below the surface.
fn draw_lobe(s: Surface, u: vec2f) -> vec3f {
    let view = view_above(s);
    return reflect(-view, draw_facet(s.normal, view, facet_width(s), u));
}

/// The density with which `draw_lobe` draws a direction above the surface, in 1/sr.
fn draw_density(s: Surface, direction: vec3f) -> f32 {
    let view = view_above(s);
    let width = facet_width(s);
    let outgoing = dot(s.normal, view);
    return facets(s.normal, normalize(direction + view), width) * unshadowed(outgoing, width) / (4.0 * outgoing);
}

fn shines(s: Surface) -> bool {
#ifdef FACES
    return s.face.w > 0.0 || s.metallic > 0.0;
#else
    return DIELECTRIC.y > 0.0 || s.metallic > 0.0;
#endif
}
