//! A cache of light on surfaces: cells of a hash table, keyed by where a surface lies and which way it faces. So light
//! does not pass walls, and there are cells only where rays end.
//!
//! Keys take their places by linear probing, the greater one the place (Shun and Blelloch, "Phase-Concurrent Hash
//! Tables for Determinism", SPAA 2014): where a key ends up is a matter of the set of keys, not of who came first.
#define_import_path lightgraph::cells
#import lightgraph::octahedron::{fold, unfold}
#import lightgraph::random::scramble
#import lightgraph::camera::{camera, pixel_ray}

struct Cells {
    camera_position: vec3f,
    /// Edge of a cell, as a share of the height that the image shows at its distance.
    cell: f32,
}
var<uniform> cells: Cells;

/// Places of the table, a power of two.
const PLACES: u32 = #{PLACES}u;
/// Places that a key may stand behind its own.
const TRIES: u32 = 32u;
const NO_CELL: u32 = 0xffffffffu;

/// Height of what the image shows a metre away; the cells of a parallel projection have one size everywhere.
fn height_shown(distance: f32) -> f32 {
    let top = pixel_ray(vec2u(camera.screen.x / 2u, 0u));
    let bottom = pixel_ray(vec2u(camera.screen.x / 2u, max(camera.screen.y - 1u, 1u)));
    return max(length(top.direction - bottom.direction) * distance, length(top.origin - bottom.origin));
}

/// The key of the cell that holds a surface; never 0.
fn key_of(position: vec3f, normal: vec3f) -> u32 {
    return key_beside(position, normal, vec3i(0), 0);
}

/// The cell that holds a place, and its size: the edge is two to the power of that, `larger` times doubled.
fn place_of(position: vec3f, larger: i32) -> vec4i {
    let shown = cells.cell * height_shown(distance(position, cells.camera_position));
    let level = i32(ceil(log2(max(shown, 1e-6)))) + larger;
    // Walls mostly lie at round numbers, where rounding would say to which side they belong.
    return vec4i(vec3i(floor(position * exp2(-f32(level)) + vec3f(0.371, 0.413, 0.437))), level);
}

/// The key of the large cell that holds a surface: for what ends where few rays did.
fn large_key_of(position: vec3f, normal: vec3f) -> u32 {
    return key_beside(position, normal, vec3i(0), LARGE);
}

/// How many times the edge of a large cell is doubled.
const LARGE: i32 = 2;

/// The key of a cell that many steps from it, of those that many times doubled.
fn key_beside(position: vec3f, normal: vec3f, steps: vec3i, larger: i32) -> u32 {
    let at = place_of(position, larger);
    let place = at.xyz + steps;
    let level = at.w;
    // As rays keep it: else what is turned by 45 degrees has one face here and another there.
    let kept = unfold(unpack4x8snorm(pack4x8snorm(vec4f(fold(normal), 0.0, 0.0))).xy);
    let size = abs(kept);
    var face = select(2u, select(1u, 0u, size.x >= size.y), max(size.x, size.y) >= size.z);
    if kept[face] < 0.0 {
        face += 3u;
    }
    let words = bitcast<vec3u>(place);
    let hash = scramble(words.x + scramble(words.y + scramble(words.z + scramble(face + 8u * u32(level + 64)))));
    return max(hash, 1u);
}

/// The place that a key stands at if no other does.
fn first_place(key: u32) -> u32 {
    return scramble(key) % PLACES;
}

/// Steps from the place that a key stands at if no other does.
fn steps_to(key: u32, place: u32) -> u32 {
    return (place + PLACES - first_place(key)) % PLACES;
}
