//! The surface that a ray meets.
#define_import_path lightgraph::hit
#import lightgraph::surface::{Record, Surface, materials}
#ifdef TEXTURES
#import lightgraph::surface::{scene_textures, texture_sampler}
#endif
#import lightgraph::trace::{Hit, triangles, closest, leave, FAR, NOTHING}

/// What stands at the end of a ray.
struct Met {
    /// Whether light leaves it towards the ray: not from nothing, nor from the back of a single-sided material.
    lit: bool,
    front: bool,
    material: u32,
    distance: f32,
    /// Unit normal of the triangle itself, on its front.
    flat_normal: vec3f,
    surface: Surface,
    /// Where rays that go on from it start.
    start: vec3f,
}

/// The surface at a hit of a ray from `origin` along `direction`. Textures are read as wide as a cone of `spread`
/// (its width over its length) sees them there.
fn describe(hit: Hit, origin: vec3f, direction: vec3f, spread: f32) -> Met {
    var met: Met;
    met.distance = hit.distance;
    if hit.triangle == NOTHING {
        return met;
    }
    let t = triangles[hit.triangle];
    let m = materials[t.material];
    let weights = vec3f(1.0 - hit.at.x - hit.at.y, hit.at);
    let normal = cross(t.b - t.a, t.c - t.a);
    met.flat_normal = normalize(normal);
    met.front = dot(met.flat_normal, direction) < 0.0;
    met.lit = met.front || m.double_sided != 0u;
    met.material = t.material;
    let side = select(-1.0, 1.0, met.front);
    var color = m.base_color.rgb;
#ifdef TEXTURES
    if m.base_color_texture != 0xffffffffu {
        let uv = weights.x * t.uva + weights.y * t.uvb + weights.z * t.uvc;
        // Texels a metre of the triangle, times the metres that the cone covers (Akenine-Moller et al., "Texture Level of
        // Detail Strategies for Real-Time Ray Tracing", 2019).
        let p = t.uvb - t.uva;
        let q = t.uvc - t.uva;
        let texels = vec2f(textureDimensions(scene_textures));
        let share = abs(p.x * q.y - p.y * q.x) * texels.x * texels.y / max(length(normal), 1e-30);
        let width = spread * hit.distance / max(abs(dot(met.flat_normal, direction)), 1e-3);
        let level = max(log2(max(sqrt(share) * width, 1e-6)), 0.0);
        color *= textureSampleLevel(scene_textures, texture_sampler, uv, m.base_color_texture, level).rgb;
    }
#endif
    met.surface = Surface(
        origin + hit.distance * direction,
        side * normalize(weights.x * t.na + weights.y * t.nb + weights.z * t.nc),
        -direction,
        color,
        select(vec3f(0.0), m.emission, met.front),
        t.material,
        m.specular,
        m.shininess,
#ifdef GGX
        m.roughness,
        m.metallic,
#endif
    );
    // From the corners, whose rounding does not grow with the ray's length.
    met.start = leave(weights.x * t.a + weights.y * t.b + weights.z * t.c, side * met.flat_normal);
    return met;
}

/// What a ray meets first.
fn look(origin: vec3f, direction: vec3f) -> Met {
    return describe(closest(origin, direction), origin, direction, 0.0);
}

/// As the draw passes record it.
fn record(met: Met) -> Record {
    if met.distance >= FAR {
        return Record(vec4f(0.0), vec4f(0.0));
    }
    let code = f32(met.material + 1u) * select(-1.0, 1.0, met.front);
    return Record(select(vec4f(0.0), vec4f(met.surface.albedo, code), met.lit), vec4f(met.surface.normal, met.distance));
}
