//! What surfaces reflect, as a matte share and up to three glossy lobes: radiance towards the viewer over radiance from
//! a direction, times the cosine, is matte/pi * cos + tints * lobes. And directions drawn in proportion to lobes.
//!
//! A lobe depends on the surface's shape and finish, not on its colour, and on a direction only through its angles to
//! the normal and the plane of incidence; so the harmonics of lobes can be kept in a table (`lobe_table`). Without GGX:
//! Phong's lobe. With GGX: glTF's (`metallic_roughness`); with PHONG, too, Phong's where a material has it.
#define_import_path lightgraph::gloss
#import lightgraph::surface::Surface
#import lightgraph::sampling::lobe_direction
#ifdef GGX
#import lightgraph::metallic_roughness
#endif

/// Whether a surface's lobe is Phong's.
fn is_phong(s: Surface) -> bool {
#ifdef GGX
#ifdef PHONG
    return s.specular > 0.0;
#else
    return false;
#endif
#else
    return true;
#endif
}

/// Albedo of the matte share.
fn matte(s: Surface) -> vec3f {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::matte(s);
    }
#endif
    return s.albedo;
}

/// Albedo of a matte surface that reflects as much: what a surface is taken for where light goes on from it in all
/// directions.
fn as_matte(s: Surface) -> vec3f {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::as_matte(s);
    }
#endif
    return min(s.albedo + vec3f(s.specular), vec3f(1.0));
}

/// How much each lobe counts, a column each. Of Phong's: its strength.
fn tints(s: Surface) -> mat3x3f {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::tints(s);
    }
#endif
    return mat3x3f(vec3f(s.specular), vec3f(0.0), vec3f(0.0));
}

/// The lobes of a surface. Nothing comes from behind.
fn lobes(s: Surface, direction: vec3f) -> vec3f {
    if dot(s.normal, direction) <= 0.0 {
        return vec3f(0.0);
    }
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::lobes(s, direction);
    }
#endif
    return vec3f(phong_lobe(s, direction), 0.0, 0.0);
}

/// What lobes themselves reflect, without what the second takes from the matte share.
fn glossy(s: Surface, parts: vec3f) -> vec3f {
    let t = tints(s);
    return parts.x * t[0] + parts.y * t[1];
}

/// Phong's (n + 1)/(2 pi) * cos(alpha)^n, where alpha is the angle to the mirror direction.
fn phong_lobe(s: Surface, direction: vec3f) -> f32 {
    let cosine = dot(reflect(-s.view, s.normal), direction);
    return (s.shininess + 1.0) / 6.28318530718 * pow(max(cosine, 1e-6), s.shininess);
}

/// How often to draw from the lobes rather than evenly: their share of what the surface reflects, about.
fn lobe_share(s: Surface) -> f32 {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::lobe_share(s);
    }
#endif
    let diffuse = max(max(s.albedo.r, s.albedo.g), s.albedo.b);
    return select(0.0, s.specular / (s.specular + diffuse), s.specular > 0.0);
}

/// A direction drawn from the first lobe; it may lie below the surface.
fn draw_lobe(s: Surface, u: vec2f) -> vec3f {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::draw_lobe(s, u);
    }
#endif
    return lobe_direction(reflect(-s.view, s.normal), s.shininess, u);
}

/// The density with which `draw_lobe` draws a direction above the surface, in 1/sr.
fn draw_density(s: Surface, direction: vec3f) -> f32 {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::draw_density(s, direction);
    }
#endif
    return phong_lobe(s, direction);
}

/// Whether a surface has lobes.
fn shines(s: Surface) -> bool {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::shines(s);
    }
#endif
    return s.specular > 0.0;
}

/// The surface whose lobes a table of harmonics up to degree `order` holds. Of Phong's, 99 % of the square of a lobe of
/// exponent n where (order + 1)² = 5 n. Sharper ones are widened, which rings less than cutting degrees off. Of glTF's,
/// this one, but for lobes so narrow that the table's sums would miss them; what harmonics don't hold of them is lost.
fn held(s: Surface, order: u32) -> Surface {
    var wider = s;
    wider.shininess = min(s.shininess, f32((order + 1u) * (order + 1u)) / 5.0);
#ifdef GGX
    // Four degrees.
    wider.roughness = max(s.roughness, 0.1414);
#endif
    return wider;
}
