//! Where light is wanted. Of each scene light, the parts of its beam in which rays ended that it lights: from these
//! photons leave. And the zones in which rays ended: photons that end elsewhere light nothing that is asked for.
#define_import_path lightgraph::marks
#import lightgraph::cells::place_of
#import lightgraph::random::scramble
#ifdef LIGHTS
#import lightgraph::lights::{Light, light_count, lights}
#import lightgraph::sampling::in_frame
#import lightgraph::trace::extent
#endif

/// Parts of all beams; bits of zones behind them.
const PARTS: u32 = #{PARTS}u;
const ZONES: u32 = 65536u;

/// Bit of the zone of a place: eight cells along.
fn zone_of(position: vec3f) -> u32 {
    let words = bitcast<vec4u>(place_of(position, 3));
    return scramble(words.x + scramble(words.y + scramble(words.z + scramble(words.w)))) % ZONES;
}

#ifdef LIGHTS
/// Number of the finest square of parts of a light's beam; it has two to the power of that along each axis.
fn last_square() -> u32 {
    return min(firstLeadingBit(max(PARTS / max(light_count(), 1u), 1u)) / 2u, 6u);
}

/// Of `beams`: the first row of a square of a light.
fn first_part(light: u32, square: u32) -> u32 {
    return (light * ((4u << (2u * last_square())) - 1u) + (1u << (2u * square)) - 1u) / 3u;
}

/// Of `marks`: a part of the finest square.
fn marked_part(light: u32, at: vec2u) -> u32 {
    return (((light << last_square()) + at.y) << last_square()) + at.x;
}

/// Half the rectangle, seen along a direction, that holds the scene.
fn half_across(direction: vec3f) -> vec2f {
    let half = 0.5 * (extent.bounds_max - extent.bounds_min);
    let across = in_frame(direction, vec3f(1.0, 0.0, 0.0));
    let up = in_frame(direction, vec3f(0.0, 1.0, 0.0));
    return max(vec2f(dot(abs(across), half), dot(abs(up), half)), vec2f(1e-20));
}

/// Solid angle that a light shines into; of a directional one the area.
fn reach(light: Light) -> f32 {
    if light.kind == 2u {
        let half = half_across(light.direction);
        return 4.0 * half.x * half.y;
    }
    return select(12.5663706144, 6.28318530718 * (1.0 - light.cos_outer), light.kind == 1u);
}

/// The axis of a light's beam; of a point any.
fn axis_of(light: Light) -> vec3f {
    return select(light.direction, vec3f(0.0, 1.0, 0.0), light.kind == 0u);
}

/// A place in the unit square for each ray of light; equal areas hold equal shares of `reach`.
fn in_beam(light: Light, point: vec3f) -> vec2f {
    let axis = axis_of(light);
    let across = in_frame(axis, vec3f(1.0, 0.0, 0.0));
    let up = in_frame(axis, vec3f(0.0, 1.0, 0.0));
    if light.kind == 2u {
        let offset = point - 0.5 * (extent.bounds_min + extent.bounds_max);
        return 0.5 + 0.5 * vec2f(dot(offset, across), dot(offset, up)) / half_across(axis);
    }
    let way = normalize(point - light.position);
    let lowest = select(-1.0, light.cos_outer, light.kind == 1u);
    let turn = atan2(dot(way, up), dot(way, across)) / 6.28318530718;
    return vec2f((dot(way, axis) - lowest) / max(1.0 - lowest, 1e-6), select(turn, turn + 1.0, turn < 0.0));
}

struct Beam {
    origin: vec3f,
    direction: vec3f,
}

/// The inverse of `in_beam`.
fn from_beam(light: Light, place: vec2f) -> Beam {
    let axis = axis_of(light);
    if light.kind == 2u {
        let at = (2.0 * place - 1.0) * half_across(axis);
        let middle = 0.5 * (extent.bounds_min + extent.bounds_max);
        let back = length(extent.bounds_max - extent.bounds_min);
        let origin = middle + at.x * in_frame(axis, vec3f(1.0, 0.0, 0.0))
            + at.y * in_frame(axis, vec3f(0.0, 1.0, 0.0)) - back * axis;
        return Beam(origin, axis);
    }
    let lowest = select(-1.0, light.cos_outer, light.kind == 1u);
    let cosine = mix(lowest, 1.0, place.x);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let turn = 6.28318530718 * place.y;
    return Beam(light.position, in_frame(axis, vec3f(sine * cos(turn), sine * sin(turn), cosine)));
}

/// The part of a light's beam that holds a point.
fn part_of(light: u32, point: vec3f) -> u32 {
    let along = f32(1u << last_square());
    let at = vec2u(clamp(in_beam(lights[light], point) * along, vec2f(0.0), vec2f(along - 1.0)));
    return marked_part(light, at);
}
#endif
