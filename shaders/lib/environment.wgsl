//! Light from all around and infinitely far, by direction: what rays see that meet nothing.
//!
//! The table `environment` holds squares of 1, 4, 16, … texels, one after the other, each row by row; every texel of a
//! square stands for the same solid angle (Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", 2008),
//! the middle being up and the corners down, and is the mean of the four below it. Only for scenes with the fact
//! `environment` above 0.
#define_import_path lightgraph::environment
#import lightgraph::quarters::quarter

struct Texel {
    radiance: vec3f,
    /// What directions are drawn by: about the sum of red, green and blue.
    weight: f32,
}
var<storage, read> environment: array<Texel>;

/// Number of the finest square; it has 4 to the power of that texels.
fn finest() -> u32 {
    // All squares together are a third of the next one's texels, rounded down.
    return firstLeadingBit(3u * arrayLength(&environment) + 1u) / 2u - 1u;
}

/// The first row of a square.
fn first_texel(square: u32) -> u32 {
    return ((1u << (2u * square)) - 1u) / 3u;
}

/// The unit direction of a place in the unit square.
fn direction_of(place: vec2f) -> vec3f {
    let p = 2.0 * place - 1.0;
    let size = abs(p);
    let below = 1.0 - size.x - size.y;
    let r = 1.0 - abs(below);
    let turn = 0.785398163397 * ((size.y - size.x) / max(r, 1e-20) + 1.0);
    let height = select(1.0, -1.0, below < 0.0) * (1.0 - r * r);
    let across = r * sqrt(max(2.0 - r * r, 0.0)) * select(vec2f(1.0), vec2f(-1.0), p < vec2f(0.0));
    return vec3f(across.x * cos(turn), height, across.y * sin(turn));
}

/// The inverse of `direction_of`.
fn place_of(direction: vec3f) -> vec2f {
    let size = abs(direction);
    // 1 - |y|, without losing its digits.
    let r = sqrt((size.x * size.x + size.z * size.z) / (1.0 + size.y));
    let turn = atan2(size.z, max(size.x, 1e-20)) * 0.636619772368;
    var p = vec2f(r - turn * r, turn * r);
    if direction.y < 0.0 {
        p = 1.0 - p.yx;
    }
    p *= select(vec2f(1.0), vec2f(-1.0), direction.xz < vec2f(0.0));
    return clamp(0.5 * p + 0.5, vec2f(0.0), vec2f(1.0));
}

/// The row of a texel of a square, at most one beside its edges: these are folded in their middles.
fn row_at(square: u32, texel: vec2i) -> u32 {
    let edge = 1i << square;
    var at = texel;
    if at.x < 0i || at.x >= edge {
        at = vec2i(select(2i * edge - 1i - at.x, -1i - at.x, at.x < 0i), edge - 1i - at.y);
    }
    if at.y < 0i || at.y >= edge {
        at = vec2i(edge - 1i - at.x, select(2i * edge - 1i - at.y, -1i - at.y, at.y < 0i));
    }
    return first_texel(square) + u32(at.y * edge + at.x);
}

/// Radiance at a place of a square, between the centres of four texels.
fn between(square: u32, place: vec2f) -> vec3f {
    let at = place * f32(1u << square) - 0.5;
    let low = vec2i(floor(at));
    let share = at - floor(at);
    let above = mix(
        environment[row_at(square, low)].radiance,
        environment[row_at(square, low + vec2i(1, 0))].radiance,
        share.x,
    );
    let below = mix(
        environment[row_at(square, low + vec2i(0, 1))].radiance,
        environment[row_at(square, low + vec2i(1, 1))].radiance,
        share.x,
    );
    return mix(above, below, share.y);
}

/// Radiance from a unit direction.
fn radiance(direction: vec3f) -> vec3f {
    return between(finest(), place_of(direction));
}

/// Mean radiance from about `solid_angle` steradians round a unit direction.
fn mean_radiance(direction: vec3f, solid_angle: f32) -> vec3f {
    let square = clamp(0.5 * log2(12.5663706144 / max(solid_angle, 1e-20)), 0.0, f32(finest()));
    let low = u32(square);
    let place = place_of(direction);
    let coarse = between(low, place);
    let share = square - f32(low);
    if share <= 0.0 {
        return coarse;
    }
    return mix(coarse, between(low + 1u, place), share);
}

/// A direction drawn by its light.
struct Drawn {
    direction: vec3f,
    radiance: vec3f,
    /// In 1/sr; 0 where there is no light at all.
    density: f32,
}

/// Draws a direction by its light, from a pair of even numbers.
fn draw(pair: vec2f) -> Drawn {
    var u = pair;
    var at = vec2u(0u);
    let last = finest();
    for (var square = 1u; square <= last; square++) {
        at *= 2u;
        let edge = 1u << square;
        let row = first_texel(square) + at.y * edge + at.x;
        let upper = vec2f(environment[row].weight, environment[row + 1u].weight);
        let lower = vec2f(environment[row + edge].weight, environment[row + edge + 1u].weight);
        let one = quarter(vec4f(upper, lower), u);
        u = one.pair;
        at += one.at;
    }
    let place = (vec2f(at) + u) / f32(1u << last);
    let row = first_texel(last) + at.y * (1u << last) + at.x;
    return Drawn(direction_of(place), between(last, place), density_of(row));
}

/// The density, in 1/sr, with which `draw` draws a unit direction.
fn draw_density(direction: vec3f) -> f32 {
    let last = finest();
    let edge = 1u << last;
    let at = min(vec2u(place_of(direction) * f32(edge)), vec2u(edge - 1u));
    return density_of(first_texel(last) + at.y * edge + at.x);
}

fn density_of(row: u32) -> f32 {
    // Of a texel's weight over the mean, spread over the sphere.
    let mean = environment[0].weight;
    return select(0.0, environment[row].weight / (12.5663706144 * mean), mean > 0.0);
}
