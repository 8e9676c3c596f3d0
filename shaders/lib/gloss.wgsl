//! What surfaces reflect, as a matte share and up to three glossy lobes: radiance towards the viewer over radiance from a
//! direction, times the cosine, is matte/pi * cos + tints * lobes.
//!
//! A lobe depends on the surface's shape and finish, not on its colour, and on a direction only through its angles
//! to the normal and the plane of incidence; so the harmonics of lobes can be kept in a table (`lobe_table`).
//! Without GGX: Phong's lobe. With GGX: glTF's metallic-roughness model.
#define_import_path lightgraph::gloss
#import lightgraph::surface::Surface

#ifdef GGX
/// Reflectance of a surface that is no metal, seen head on.
const DIELECTRIC: f32 = 0.04;
/// Least width of the distribution of normals: a lobe four degrees wide.
const SHARPEST: f32 = 0.02;
/// Lobes that `lobes` gives.
const LOBES: u32 = 3u;

/// Albedo of the matte share: of what is no metal, what the lobe does not reflect.
fn matte(s: Surface) -> vec3f {
    return (1.0 - s.metallic) * (1.0 - DIELECTRIC) * s.albedo;
}

/// Reflectance head on for the first lobe, what is missing to 1 for the second; the third is what the second takes from
/// the matte share.
fn tints(s: Surface) -> mat3x3f {
    let head_on = mix(vec3f(DIELECTRIC), s.albedo, s.metallic);
    return mat3x3f(head_on, 1.0 - head_on, -matte(s));
}

/// The lobes of microfacets (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007): as if they
/// reflected all; times Schlick's (1 - cos)^5; and a matte surface times that.
fn lobes(s: Surface, direction: vec3f) -> vec3f {
    let incoming = dot(s.normal, direction);
    let outgoing = max(dot(s.normal, s.view), 1e-4);
    if incoming <= 0.0 {
        return vec3f(0.0);
    }
    let half = normalize(direction + s.view);
    let width = max(s.roughness * s.roughness, SHARPEST);
    let square = width * width;
    let up = dot(s.normal, half);
    let spread = up * up * (square - 1.0) + 1.0;
    let facets = square / (3.14159265359 * spread * spread);
    let lobe = facets * unshadowed(incoming, square) * unshadowed(outgoing, square) / (4.0 * outgoing);
    let edge = pow(clamp(1.0 - dot(s.view, half), 0.0, 1.0), 5.0);
    return vec3f(lobe, lobe * edge, edge * incoming / 3.14159265359);
}

/// Smith's share of facets that others don't hide at this cosine.
fn unshadowed(cosine: f32, square: f32) -> f32 {
    let tangent = (1.0 - cosine * cosine) / (cosine * cosine);
    return 2.0 / (1.0 + sqrt(1.0 + square * max(tangent, 0.0)));
}

/// Whether a surface has lobes.
fn shines(s: Surface) -> bool {
    return true;
}

/// The surface whose lobes harmonics up to degree `order` hold: this one; what they don't hold of sharper lobes is lost.
fn held(s: Surface, order: u32) -> Surface {
    return s;
}
#else
const LOBES: u32 = 1u;

fn matte(s: Surface) -> vec3f {
    return s.albedo;
}

/// Phong's strength.
fn tints(s: Surface) -> mat3x3f {
    return mat3x3f(vec3f(s.specular), vec3f(0.0), vec3f(0.0));
}

/// Phong's (n + 1)/(2 pi) * cos(alpha)^n, where alpha is the angle to the mirror direction. Nothing comes from behind.
fn lobes(s: Surface, direction: vec3f) -> vec3f {
    if dot(s.normal, direction) <= 0.0 {
        return vec3f(0.0);
    }
    let cosine = dot(reflect(-s.view, s.normal), direction);
    return vec3f((s.shininess + 1.0) / 6.28318530718 * pow(max(cosine, 1e-6), s.shininess), 0.0, 0.0);
}

/// Whether a surface has a lobe.
fn shines(s: Surface) -> bool {
    return s.specular > 0.0;
}

/// The surface whose lobe harmonics up to degree `order` hold: 99 % of the square of a lobe of exponent n where
/// (order + 1)² = 5 n. Sharper ones are widened, which rings less than cutting degrees off.
fn held(s: Surface, order: u32) -> Surface {
    var wider = s;
    wider.shininess = min(s.shininess, f32((order + 1u) * (order + 1u)) / 5.0);
    return wider;
}
#endif
