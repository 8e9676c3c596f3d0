//! Directions in which the image's points see the environment. Each block of points counts them, so that more are drawn
//! where a window is.
//!
//! A block has squares of 1, 4, 16, … counts over the directions of `lightgraph::environment`.
#define_import_path lightgraph::sky_guide
#import lightgraph::camera::camera
#import lightgraph::environment::{direction_of, place_of}
#import lightgraph::quarters::quarter
#import lightgraph::tiles::TILE

/// Points along a block.
const BLOCK: u32 = 16u;
/// Number of the finest square, texels along it, and the first of them.
const FINEST: u32 = 4u;
const EDGE: u32 = 1u << FINEST;
const FIRST: u32 = (EDGE * EDGE - 1u) / 3u;
/// Counts of a block.
const COUNTS: u32 = FIRST + EDGE * EDGE;
/// See sky_guide.wgsl.
var<storage, read> sky_guide: array<f32>;

/// The first count of the block that holds a pixel.
fn block_of(pixel: vec2u) -> u32 {
    let edge = TILE * BLOCK;
    let across = (camera.screen.x + edge - 1u) / edge;
    return COUNTS * (pixel.y / edge * across + pixel.x / edge);
}

/// The texel of the finest square that holds a direction.
fn bin_of(direction: vec3f) -> u32 {
    let at = min(vec2u(place_of(direction) * f32(EDGE)), vec2u(EDGE - 1u));
    return at.y * EDGE + at.x;
}

/// A direction drawn by a block's counts, from a pair of even numbers.
fn guided(block: u32, pair: vec2f) -> vec3f {
    var u = pair;
    var at = vec2u(0u);
    for (var square = 1u; square <= FINEST; square++) {
        at *= 2u;
        let edge = 1u << square;
        let first = block + ((1u << (2u * square)) - 1u) / 3u + at.y * edge + at.x;
        let upper = vec2f(sky_guide[first], sky_guide[first + 1u]);
        let lower = vec2f(sky_guide[first + edge], sky_guide[first + edge + 1u]);
        let one = quarter(vec4f(upper, lower), u);
        u = one.pair;
        at += one.at;
    }
    return direction_of((vec2f(at) + u) / f32(EDGE));
}

/// How many directions a pixel draws by the environment's light, and by its block's counts, where there are any.
fn draws(block: u32, samples: u32) -> vec2u {
    return select(vec2u(samples, 0u), vec2u(samples / 2u, samples + samples / 2u), sky_guide[block] > 0.0);
}

/// How densely all of them lie round a direction, in 1/sr, where one by light has the density `by_light`.
fn drawn_density(block: u32, samples: u32, direction: vec3f, by_light: f32) -> f32 {
    let count = vec2f(draws(block, samples));
    if count.y == 0.0 {
        return count.x * by_light;
    }
    let share = sky_guide[block + FIRST + bin_of(direction)] / sky_guide[block];
    return count.x * by_light + count.y * share * f32(EDGE * EDGE) / 12.5663706144;
}
