//! The distribution of a rough surface's facets: GGX, with Smith's shadowing (Walter et al., "Microfacet Models for
//! Refraction through Rough Surfaces", 2007). `width` is the distribution's alpha.
#define_import_path lightgraph::microfacets
#import lightgraph::sampling::in_frame

/// Facets' area with the unit normal `half`, per area of the surface, in 1/sr.
fn facets(normal: vec3f, half: vec3f, width: f32) -> f32 {
    let up = dot(normal, half);
    // The sine from a cross product: 1 - up² would lose narrow distributions to rounding.
    let across = cross(normal, half);
    let spread = width * width * up * up + dot(across, across);
    return width * width / (3.14159265359 * spread * spread);
}

/// Smith's share of facets that others don't hide at this cosine.
fn unshadowed(cosine: f32, width: f32) -> f32 {
    let tangent = (1.0 - cosine * cosine) / (cosine * cosine);
    return 2.0 / (1.0 + sqrt(1.0 + width * width * max(tangent, 0.0)));
}

/// The normal of a facet drawn from those that the unit `view`, above the surface, sees: of density
/// `unshadowed` * max(view . half, 0) * `facets` / (view . normal). Where the facets are those of a sphere, that is
/// half way to a direction evenly drawn from a cap of it (Dupuy and Benyoub, "Sampling Visible GGX Normals with
/// Spherical Caps", 2023).
fn draw_facet(normal: vec3f, view: vec3f, width: f32, u: vec2f) -> vec3f {
    let up = dot(normal, view) * normal;
    let stretched = normalize(up + width * (view - up));
    let height = 1.0 - u.x * (1.0 + dot(stretched, normal));
    let sine = sqrt(max(1.0 - height * height, 0.0));
    let round = 6.28318530718 * u.y;
    let half = stretched + in_frame(normal, vec3f(sine * cos(round), sine * sin(round), height));
    let along = max(dot(half, normal), 1e-7) * normal;
    return normalize(along + width * (half - dot(half, normal) * normal));
}
