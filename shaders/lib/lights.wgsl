//! Light straight from the scene's lights. Units as in glTF's KHR_lights_punctual, taken as radiometric: point and
//! spot lights in W/sr a channel, directional ones in W/m².
//!
//! With LIGHT_UNIFORMS the rows of lights lie in uniforms: for scenes that have few. With SUN_RAYS shadows of
//! directional lights are traced: a map of one would have to show the whole scene.
#define_import_path lightgraph::lights
#import lightgraph::cube
#import lightgraph::surface::Surface
#import lightgraph::lobe::reflectance
#ifdef SUN_RAYS
#import lightgraph::trace::{FAR, is_free, leave}
#endif

struct Light {
    /// 0 point, 1 spot, 2 directional.
    kind: u32,
    position: vec3f,
    /// Of travel, unit.
    direction: vec3f,
    intensity: vec3f,
    /// Metres; 0 for none.
    range: f32,
    cos_inner: f32,
    cos_outer: f32,
    /// Rows of `light_views`.
    first_view: u32,
    views: u32,
}

struct LightView {
    view_projection: mat4x4f,
    near: f32,
    far: f32,
}

#ifdef LIGHT_UNIFORMS
var<uniform> lights: array<Light, #{LIGHT_ROWS}>;
var<uniform> light_views: array<LightView, #{VIEW_ROWS}>;

fn light_count() -> u32 {
    return #{LIGHT_ROWS}u;
}

fn view_count() -> u32 {
    return #{VIEW_ROWS}u;
}
#else
var<storage, read> lights: array<Light>;
var<storage, read> light_views: array<LightView>;

fn light_count() -> u32 {
    return arrayLength(&lights);
}

fn view_count() -> u32 {
    return arrayLength(&light_views);
}
#endif

#ifdef SHADOW_TEXELS
/// Depth of what each light view sees, row by row, one square a view.
var<storage, read> shadow_texels: array<f32>;
#else
/// Depth of what each light view sees, one layer a view.
var shadow_map: texture_depth_2d_array;
/// Any that keeps to the map.
var shadow_sampler: sampler;
#endif

struct Shadow {
    /// Texels along a shadow map.
    shadow_size: u32,
    /// Offset along the normal that keeps a surface out of its own shadow, in shadow texels.
    bias: f32,
}
var<uniform> shadow: Shadow;

/// Light that reaches a point from one light.
struct Arrival {
    /// Unit, towards the light.
    direction: vec3f,
    /// Irradiance on a surface that faces the light, unshadowed.
    irradiance: vec3f,
}

fn arrival(light: Light, point: vec3f) -> Arrival {
    if light.kind == 2u {
        return Arrival(-light.direction, light.intensity);
    }
    let to_light = light.position - point;
    let distance_squared = max(dot(to_light, to_light), 1e-12);
    let inverse = inverseSqrt(distance_squared);
    let direction = to_light * inverse;
    var strength = inverse * inverse;
    if light.range > 0.0 {
        // The window that KHR_lights_punctual recommends.
        let share = distance_squared / (light.range * light.range);
        strength *= clamp(1.0 - share * share, 0.0, 1.0);
    }
    if light.kind == 1u {
        let width = max(light.cos_inner - light.cos_outer, 0.001);
        let cone = clamp((-dot(direction, light.direction) - light.cos_outer) / width, 0.0, 1.0);
        strength *= cone * cone;
    }
    return Arrival(direction, strength * light.intensity);
}

/// Where a shadow map shows a point.
struct Shown {
    /// Of `light_views`.
    view: u32,
    clip: vec4f,
    /// Of what the map shows at the depth of the point, in metres.
    width: f32,
    /// Between the view's axis and a direction.
    cosine: f32,
}

/// Where the light's shadow map shows a point. A light with six views has those of a cube map seen from outside, left
/// and right exchanged: what each shows follows from where the light is, without the matrix of each.
fn shown(light: Light, point: vec3f, normal: vec3f) -> Shown {
    let first = light_views[light.first_view];
    if light.views == 6u {
        let offset = point - light.position;
        let face = cube::face_of(offset);
        let at = cube::inward(face, offset);
        let depth = first.far / (first.far - first.near) * (at.z - first.near);
        return Shown(light.first_view + face, vec4f(-at.xy, depth, at.z), 2.0 * at.z, cube::inward(face, normal).z);
    }
    let m = first.view_projection;
    let clip = m * vec4f(point, 1.0);
    let along = vec3f(m[0].z, m[1].z, m[2].z);
    let across = vec3f(m[0].x, m[1].x, m[2].x);
    let width = 2.0 * abs(clip.w) * inverseSqrt(dot(across, across));
    return Shown(light.first_view, clip, width, dot(normal, along) * inverseSqrt(dot(along, along)));
}

/// Depths in a view's map at four texels: at `low` and the next along x, then those below. Beyond the map those at its
/// edge.
fn depths_at(view: u32, low: vec2f, texel: f32) -> vec4f {
#ifdef SHADOW_TEXELS
    let last = i32(shadow.shadow_size) - 1;
    let x = vec2u(clamp(vec2i(i32(low.x)) + vec2i(0, 1), vec2i(0), vec2i(last)));
    let y = (vec2u(clamp(vec2i(i32(low.y)) + vec2i(0, 1), vec2i(0), vec2i(last))) + view * shadow.shadow_size)
        * shadow.shadow_size;
    return vec4f(
        shadow_texels[y.x + x.x],
        shadow_texels[y.x + x.y],
        shadow_texels[y.y + x.x],
        shadow_texels[y.y + x.y],
    );
#else
    // Looked up where the four meet, which no rounding mistakes for others.
    return textureGather(shadow_map, shadow_sampler, (low + 1.0) * texel, view).wzxy;
#endif
}

/// Where a surface is looked up in a light's shadow map.
struct Look {
    /// Of `light_views`.
    view: u32,
    depth: f32,
    /// In texels, from the centre of the first one.
    at: vec2f,
    /// It lies before the light.
    ahead: bool,
}

/// The map holds the depth at its texels' centres. A plane stays clear of its own map when the point looked up is
/// moved along the normal by the distance to those centres, a texel's diagonal at most, times the sine between the
/// normal and the view's axis: 1.42 texels at most. A tenth covers the rounding of depths where the sine vanishes.
/// Where the normal is not the plane's, the sine is the largest that the plane may have, and the way a longer one; on
/// average normals lie half as far off as at corners.
fn look(light: Light, s: Surface) -> Look {
    let edge = f32(shadow.shadow_size);
    let texel = 1.0 / edge;
    let here = shown(light, s.position, s.normal);
    let sine = sqrt(max(1.0 - here.cosine * here.cosine, 0.0));
    var way = max(sine, 0.1);
#ifdef SMOOTH
    let tilt = 0.5 * s.deviation;
    let along = sqrt(1.0 - tilt * tilt);
    way = clamp(sine * along + abs(here.cosine) * tilt, 0.1, 1.0) / along;
#endif
    let moved = shown(light, s.position + shadow.bias * here.width * texel * way * s.normal, s.normal);
    let ndc = moved.clip.xyz * (1.0 / moved.clip.w);
    let at = (ndc.xy * vec2f(0.5, -0.5) + 0.5) * edge - 0.5;
    return Look(moved.view, ndc.z, at, moved.clip.w > 0.0);
}

/// Share of a light that reaches a surface, 0 to 1: its shadow map at the four texels round the point, weighed
/// bilinearly.
fn visibility(light: Light, s: Surface) -> f32 {
    let there = look(light, s);
    if !there.ahead {
        return 1.0;
    }
    let low = floor(there.at);
    let share = there.at - low;
    let lit = vec4f(there.depth) <= depths_at(there.view, low, 1.0 / f32(shadow.shadow_size));
    let near = 1.0 - share;
    return dot(
        select(vec4f(0.0), vec4f(1.0), lit),
        vec4f(near.x * near.y, share.x * near.y, near.x * share.y, share.x * share.y),
    );
}

/// Radiance that a surface would reflect towards its viewer straight from one light, if nothing stood between.
fn unshadowed(light: Light, s: Surface) -> vec3f {
    let a = arrival(light, s.position);
    return reflectance(s, a.direction) * a.irradiance;
}

/// Radiance that a surface reflects towards its viewer straight from one light.
fn reflected_from(i: u32, s: Surface) -> vec3f {
    let light = lights[i];
    let reflected = unshadowed(light, s);
    if all(reflected <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    return visibility(light, s) * reflected;
}

/// The same from all lights.
fn reflected_light(s: Surface) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < light_count(); i++) {
#ifdef SUN_RAYS
        if lights[i].kind == 2u {
            continue;
        }
#endif
        sum += reflected_from(i, s);
    }
#ifdef SUN_RAYS
    // In a loop of their own: llvmpipe of Mesa 22.3 crashes where a map is gathered from and a ray traced in one.
    for (var i = 0u; i < light_count(); i++) {
        if lights[i].kind == 2u {
            let reflected = unshadowed(lights[i], s);
            let towards = -lights[i].direction;
            if any(reflected > vec3f(0.0)) && is_free(leave(s.position, s.normal + s.view), towards, FAR) {
                sum += reflected;
            }
        }
    }
#endif
    return sum;
}
