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

/// Powers of the cosine to the viewer, on the mean over the directions that a matte surface sends light to.
const MEAN_POWERS: vec4f = vec4f(1.0, 2.0 / 3.0, 0.5, 0.4);

/// The same towards one viewer.
fn powers(cosine: f32) -> vec4f {
    let c = max(cosine, 0.0);
    return vec4f(1.0, c, c * c, c * c * c);
}

/// Shares of light from all around that facets reflect towards a viewer, as if they reflected all and times Schlick's
/// (1 - cos)^5, and a matte surface times that, by `powers` of the cosine to the viewer. A fit to the integrals, cubic
/// in it and in roughness: 0.006, 0.002 and 0.0001 off on the mean.
fn reflected_shares(roughness: f32, powers: vec4f) -> vec3f {
    let r = vec4f(1.0, roughness, roughness * roughness, roughness * roughness * roughness);
    let all = mat4x4f(
        1.053, -0.108, -0.122, 0.137, -1.178, 4.693, -3.664, 0.745,
        2.386, -13.844, 14.462, -4.623, -1.681, 8.927, -10.728, 3.822,
    );
    let edge = mat4x4f(
        1.053, -4.46, 6.157, -2.767, -2.329, 12.523, -20.119, 10.024,
        1.173, -10.886, 21.481, -11.932, 0.155, 2.658, -7.353, 4.623,
    );
    let matte = dot(powers, vec4f(0.028, -0.0773, 0.0749, -0.0257));
    return clamp(vec3f(dot(powers, all * r), dot(powers, edge * r), matte), vec3f(0.0), vec3f(1.0));
}
