//! glTF's metallic-roughness model as lobes of `gloss`: GGX, Smith's shadowing, Schlick's Fresnel term.
//!
//! Metals reflect with the base colour. What is no metal is matte; with DIELECTRICS it reflects at its face, too, with
//! FACES what states what its face does.
#define_import_path lightgraph::metallic_roughness
#import lightgraph::surface::Surface
#import lightgraph::microfacets::{facets, unshadowed, draw_facet}

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

/// Shares of light from all around that the first two lobes reflect at this roughness and cosine to the viewer: cubic in
/// both, 0.006 and 0.002 off on the mean over the hemisphere.
fn reflected_shares(roughness: f32, cosine: f32) -> vec2f {
    let r = vec4f(1.0, roughness, roughness * roughness, roughness * roughness * roughness);
    let c = vec4f(1.0, cosine, cosine * cosine, cosine * cosine * cosine);
    let first = mat4x4f(
        1.053, -0.108, -0.122, 0.137, -1.178, 4.693, -3.664, 0.745,
        2.386, -13.844, 14.462, -4.623, -1.681, 8.927, -10.728, 3.822,
    );
    let second = mat4x4f(
        1.053, -4.46, 6.157, -2.767, -2.329, 12.523, -20.119, 10.024,
        1.173, -10.886, 21.481, -11.932, 0.155, 2.658, -7.353, 4.623,
    );
    return clamp(vec2f(dot(c, first * r), dot(c, second * r)), vec2f(0.0), vec2f(1.0));
}

/// Albedo of a matte surface that reflects as much towards the viewer of light from all around.
fn as_matte(s: Surface) -> vec3f {
    let parts = tints(s);
    let shares = reflected_shares(s.roughness, max(dot(s.normal, s.view), 0.0));
    return matte(s) + shares.x * parts[0] + shares.y * parts[1];
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
