//! The surface that a ray meets.
#define_import_path lightgraph::hit
#import lightgraph::surface::{Point, Record, Surface, Wide, albedo_at, base_color, bent_normal, materials}
#ifdef TEXTURES
#import lightgraph::surface::read_texture
#endif
#ifdef METALS
#import lightgraph::surface::finish
#endif
#ifdef FACES
#import lightgraph::surface::face_of
#endif
#ifdef COATS
#import lightgraph::surface::bent_coat_normal
#endif
#ifdef GLOW
#import lightgraph::surface::{glows, join}
#endif
#import lightgraph::trace::{Hit, Triangle, triangles, clearance, closest, leave, FAR, NOTHING}

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
#ifdef GLOW
    /// What its emission is multiplied by; of what no light shows, its colour.
    glow: vec3f,
#endif
#ifdef EMISSION_MAPS
    /// Row of `emitters`, 0xffffffff for none.
    emitter: u32,
#endif
#ifdef CLEAR
    /// Share of the surface that is there.
    there: f32,
    /// Where rays that go on behind it start.
    beyond: vec3f,
#endif
}

/// What the corners of a triangle say of a point between them.
fn point_of(t: Triangle, weights: vec3f) -> Point {
    var p: Point;
#ifdef TEXTURES
    p.uv = mat3x2f(t.uva, t.uvb, t.uvc) * weights;
#endif
#ifdef SECOND_UVS
    p.second_uv = mat3x2f(t.uv2a, t.uv2b, t.uv2c) * weights;
#endif
#ifdef VERTEX_COLORS
    p.color = mat3x4f(t.ca, t.cb, t.cc) * weights;
#endif
#ifdef NORMAL_MAPS
    p.tangent = vec4f((mat3x4f(t.ta, t.tb, t.tc) * weights).xyz, t.ta.w);
#endif
    return p;
}

#ifdef TEXTURES
/// What coordinates grow by over a width in metres on a triangle of this area, twice (Akenine-Moller et al., "Texture
/// Level of Detail Strategies for Real-Time Ray Tracing", 2019).
fn spread_of(a: vec2f, b: vec2f, c: vec2f, area: f32, width: f32) -> mat2x2f {
    let p = b - a;
    let q = c - a;
    let side = sqrt(abs(p.x * q.y - p.y * q.x) / max(area, 1e-30)) * width;
    return mat2x2f(side, 0.0, 0.0, side);
}
#endif

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
    let p = point_of(t, weights);
    var wide: Wide;
#ifdef TEXTURES
    let width = spread * hit.distance / max(abs(dot(met.flat_normal, direction)), 1e-3);
    wide.uv = spread_of(t.uva, t.uvb, t.uvc, length(normal), width);
#ifdef SECOND_UVS
    wide.second_uv = spread_of(t.uv2a, t.uv2b, t.uv2c, length(normal), width);
#endif
#endif
    let color = base_color(m, p, wide);
    var s: Surface;
    s.position = origin + hit.distance * direction;
    let shading = weights.x * t.na + weights.y * t.nb + weights.z * t.nc;
    s.normal = side * bent_normal(m, shading, p, wide);
    s.view = -direction;
    s.albedo = albedo_at(m, color.rgb, p, wide);
    s.emission = select(vec3f(0.0), m.emission, met.front);
    s.material = t.material;
    s.specular = m.specular;
    s.shininess = m.shininess;
#ifdef SMOOTH
    s.deviation = m.normal_deviation;
#endif
#ifdef METALS
    let made = finish(m, p, wide);
    s.roughness = made.x;
    s.metallic = made.y;
#endif
#ifdef EMISSION_MAPS
    met.glow = read_texture(m.emission_texture, p, wide).rgb;
    s.emission *= met.glow;
    met.emitter = t.emitter;
#endif
#ifdef UNLIT
    if m.unlit != 0u {
        met.glow = color.rgb;
        s.albedo = vec3f(0.0);
    }
#endif
#ifdef FACES
    s.face = face_of(m);
#ifdef TEXTURES
    s.face *= vec4f(read_texture(m.face_tint_texture, p, wide).rgb, 1.0) * read_texture(m.face_texture, p, wide).a;
#endif
#endif
#ifdef COATS
    s.coat = vec2f(m.coat, m.coat_roughness);
#ifdef TEXTURES
    s.coat *= vec2f(read_texture(m.coat_texture, p, wide).r, read_texture(m.coat_roughness_texture, p, wide).g);
#endif
    s.coat_normal = side * bent_coat_normal(m, shading, p, wide);
#endif
    let place = weights.x * t.a + weights.y * t.b + weights.z * t.c;
#ifdef CLEAR
    // Of what light goes through, the back that a single-sided material does not have is nothing.
    let sheet = m.alpha_blend != 0u || m.transmission > 0.0;
    met.there = select(select(1.0, color.a, m.alpha_blend != 0u), 0.0, sheet && !met.lit);
    s.transmission = m.transmission;
#ifdef TEXTURES
    s.transmission *= read_texture(m.transmission_texture, p, wide).r;
#endif
    met.beyond = leave(place, -side * met.flat_normal);
#endif
    met.surface = s;
    // From the corners, whose rounding does not grow with the ray's length.
    met.start = leave(place, side * met.flat_normal);
    return met;
}

/// What a ray meets first.
fn look(origin: vec3f, direction: vec3f) -> Met {
    return describe(closest(origin, direction), origin, direction, 0.0);
}

/// What a ray meets first that leaves a surface at `point`. It begins at `start`, just before that surface, which faces
/// about `normal`. A bent normal may send a ray below its own triangle: it meets that triangle's plane, and brings no
/// light.
fn look_from(start: vec3f, point: vec3f, normal: vec3f, direction: vec3f) -> Met {
    var met = look(start, direction);
    let plane = flat_side(met);
    if met.lit && dot(plane, normal) > 0.5 && dot(plane, point - met.surface.position) < 0.25 * clearance() {
        met.lit = false;
        met.surface.emission = vec3f(0.0);
    }
    return met;
}

/// Unit normal of the triangle itself on the side that a ray met.
fn flat_side(met: Met) -> vec3f {
    return select(-met.flat_normal, met.flat_normal, met.front);
}

/// As the draw passes record it.
fn record(met: Met) -> Record {
    if met.distance >= FAR {
        return Record(vec4f(0.0), vec4f(0.0));
    }
    let code = f32(met.material + 1u) * select(-1.0, 1.0, met.front);
    var color = met.surface.albedo;
#ifdef GLOW
    if glows(materials[met.material]) {
        color = join(color, met.glow);
    }
#endif
    return Record(select(vec4f(0.0), vec4f(color, code), met.lit), vec4f(met.surface.normal, met.distance));
}
