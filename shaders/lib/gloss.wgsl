//! What surfaces reflect, as a matte share and up to three glossy lobes: radiance towards the viewer over radiance from
//! a direction, times the cosine, is matte/pi * cos + tints * lobes. And directions drawn in proportion to lobes.
//!
//! A lobe depends on the surface's shape and finish, not on its colour, and on a direction only through its angles to
//! the normal and the plane of incidence; so the harmonics of lobes can be kept in a table (`lobe_table`). Without GGX:
//! Phong's lobe. With GGX: glTF's (`metallic_roughness`); with PHONG, too, Phong's where a material has it.
#define_import_path lightgraph::gloss
#import lightgraph::microfacets::{MEAN_POWERS, powers}
#import lightgraph::sampling::lobe_direction
#import lightgraph::sent::{Sent, sent_evenly}
#import lightgraph::surface::Surface
#ifdef GGX
#import lightgraph::metallic_roughness
#import lightgraph::microfacets::reflected_shares
#import lightgraph::sent::LEAST_ROUGHNESS
#endif

#ifdef COATS
/// The largest number below 1.
const BELOW_1: f32 = 0.99999994;
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

#ifdef COATS
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

fn is_above_coat(s: Surface, direction: vec3f) -> bool {
    return dot(s.coat_normal, direction) > 0.0;
}

/// Of the directions drawn from lobes, the share that the clear layer's gets.
fn coat_draws(s: Surface) -> f32 {
    return min(coat_share(s) / max(lobe_share(s), 1e-20), 1.0);
}
#endif

/// Albedo of the matte share.
fn matte(s: Surface) -> vec3f {
    var found = s.albedo;
#ifdef GGX
    if !is_phong(s) {
        found = metallic_roughness::matte(s);
    }
#endif
#ifdef COATS
    found *= 1.0 - coat_share(s);
#endif
    return found;
}

/// Albedo of a matte surface that reflects as much towards the viewer of light from all around.
fn as_matte(s: Surface) -> vec3f {
    let below = below_coat(s, powers(dot(s.normal, s.view)));
#ifdef COATS
    return (1.0 - coat_share(s)) * below + by_coat(s);
#else
    return below;
#endif
}

/// The same on the mean over all viewers: what a surface is taken for where light goes on from it in all directions.
fn mean_albedo(s: Surface) -> vec3f {
    let below = below_coat(s, MEAN_POWERS);
#ifdef COATS
    return mix(below, reflected_shares(s.coat.y, MEAN_POWERS).xxx, mean_coat_share(s));
#else
    return below;
#endif
}

/// Share of light from one direction that goes on in all directions. Lobes are reciprocal: a viewer there would see as
/// much of light from all around.
fn sent_on(s: Surface, direction: vec3f) -> vec3f {
    let below = below_coat(s, powers(dot(s.normal, direction)));
#ifdef COATS
    var seen = s;
    seen.view = direction;
    // What lies below a coat is dimmed by the viewer's share alone.
    return (1.0 - mean_coat_share(s)) * below + by_coat(seen);
#else
    return below;
#endif
}

/// The same, told apart.
fn sent_from(s: Surface, direction: vec3f) -> Sent {
    let all = sent_on(s, direction);
#ifdef GGX
    if !is_phong(s) {
        let evenly = min(matte(s), all);
        return Sent(evenly, all - evenly, direction, s.normal, max(s.roughness, LEAST_ROUGHNESS));
    }
#endif
    return sent_evenly(all);
}

/// What lies below a clear layer reflects this of light from all around, by powers of the cosine to the viewer.
fn below_coat(s: Surface, powers: vec4f) -> vec3f {
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::reflected_evenly(s, powers);
    }
#endif
    return min(s.albedo + vec3f(s.specular), vec3f(1.0));
}

#ifdef COATS
/// What a clear layer reflects towards the viewer of light from all around.
fn by_coat(s: Surface) -> vec3f {
    return vec3f(coat_share(s) * reflected_shares(s.coat.y, powers(dot(s.coat_normal, s.view))).x);
}

/// `coat_share` on the mean over all viewers: of (1 - cos)^5 it is 1/21.
fn mean_coat_share(s: Surface) -> f32 {
    return s.coat.x * (0.04 + 0.96 / 21.0);
}
#endif

/// How much each lobe counts, a column each. Of Phong's: its strength.
fn tints(s: Surface) -> mat3x3f {
    var found = mat3x3f(vec3f(s.specular), vec3f(0.0), vec3f(0.0));
#ifdef GGX
    if !is_phong(s) {
        found = metallic_roughness::tints(s);
    }
#endif
#ifdef COATS
    found *= 1.0 - coat_share(s);
#endif
    return found;
}

/// The lobes of a surface, but for that of a clear layer. Nothing comes from behind.
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

/// What all lobes reflect.
fn glossy(s: Surface, direction: vec3f) -> vec3f {
    var sum = tints(s) * lobes(s, direction);
#ifdef COATS
    if is_above_coat(s, direction) {
        sum += vec3f(coat_share(s) * metallic_roughness::lobes(coat_of(s), direction).x);
    }
#endif
    return sum;
}

/// Of that, what the second lobe takes from the matte share: not above 0.
fn taken(s: Surface, direction: vec3f) -> vec3f {
    return tints(s)[2] * lobes(s, direction).z;
}

/// Phong's (n + 1)/(2 pi) * cos(alpha)^n, where alpha is the angle to the mirror direction.
fn phong_lobe(s: Surface, direction: vec3f) -> f32 {
    let cosine = dot(reflect(-s.view, s.normal), direction);
    return (s.shininess + 1.0) / 6.28318530718 * pow(max(cosine, 1e-6), s.shininess);
}

/// How often to draw from the lobes rather than evenly: their share of what the surface reflects, about.
fn lobe_share(s: Surface) -> f32 {
    let diffuse = max(max(s.albedo.r, s.albedo.g), s.albedo.b);
    var share = select(0.0, s.specular / (s.specular + diffuse), s.specular > 0.0);
#ifdef GGX
    if !is_phong(s) {
        share = metallic_roughness::lobe_share(s);
    }
#endif
#ifdef COATS
    share = mix(share, 1.0, coat_share(s));
#endif
    return share;
}

/// A direction drawn from the lobes; it may lie below the surface.
fn draw_lobe(s: Surface, u: vec2f) -> vec3f {
    var pair = u;
#ifdef COATS
    let draws = coat_draws(s);
    if u.x < draws {
        return metallic_roughness::draw_lobe(coat_of(s), vec2f(min(u.x / draws, BELOW_1), u.y));
    }
    pair.x = min((u.x - draws) / (1.0 - draws), BELOW_1);
#endif
#ifdef GGX
    if !is_phong(s) {
        return metallic_roughness::draw_lobe(s, pair);
    }
#endif
    return lobe_direction(reflect(-s.view, s.normal), s.shininess, pair);
}

/// The density with which `draw_lobe` draws a direction above the surface, in 1/sr; 0 for one below.
fn draw_density(s: Surface, direction: vec3f) -> f32 {
    var density = 0.0;
    if dot(s.normal, direction) > 0.0 {
        density = phong_lobe(s, direction);
#ifdef GGX
        if !is_phong(s) {
            density = metallic_roughness::draw_density(s, direction);
        }
#endif
    }
#ifdef COATS
    var coat = 0.0;
    if is_above_coat(s, direction) {
        coat = metallic_roughness::draw_density(coat_of(s), direction);
    }
    density = mix(density, coat, coat_draws(s));
#endif
    return density;
}

/// Whether a surface has lobes.
fn shines(s: Surface) -> bool {
    var found = s.specular > 0.0;
#ifdef GGX
    if !is_phong(s) {
        found = metallic_roughness::shines(s);
    }
#endif
#ifdef COATS
    found = found || s.coat.x > 0.0;
#endif
    return found;
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
