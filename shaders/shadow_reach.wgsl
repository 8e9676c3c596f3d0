//! Which squares of the lights' shadow maps the surfaces that a probe sees are looked up in, a workgroup a probe: a row
//! of bits, each for as many squares in a row as it takes. There are 32 by 32 of them in a map, row by row, map after
//! map. What no light reaches is not looked up.
#import lightgraph::cube
#import lightgraph::instances
#import lightgraph::lights
#import lightgraph::packed_surface::surface_at
#import lightgraph::probes
#import lightgraph::surface::{is_lit, read_record}

/// Words of a row, at most.
const WORDS: u32 = 64u;
const SQUARES: u32 = 32u;
const LANES: u32 = 32u;
/// What a place in a map may be off by, in texels, for its rounding.
const MARGIN: f32 = 0.01;
const NONE: u32 = 0xffffffffu;

struct Params {
    grid: vec3u,
    cube_surface_tile: u32,
    cube_surface_columns: u32,
}
var<uniform> params: Params;
var<storage, read_write> shadow_reach: array<u32>;

var<workgroup> row: array<atomic<u32>, WORDS>;

@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let probe = instances::number(group);
    let grid = params.grid;
    let words = arrayLength(&shadow_reach) / (grid.x * grid.y * grid.z);
    for (var word = lane; word < words; word += LANES) {
        atomicStore(&row[word], 0u);
    }
    workgroupBarrier();
    let edge = params.cube_surface_tile;
    let eye = probes::position(probes::coordinates(probe));
    for (var i = 0u; i < lights::light_count(); i++) {
        let light = lights::lights[i];
        // Neighbours mostly fall into the same square.
        var last = NONE;
        for (var texel = lane; texel < 6u * edge * edge; texel += LANES) {
            let face = texel / (edge * edge);
            let at = vec2u(texel % edge, texel / edge % edge);
            let r = surface_at(cube::corner(probe * 6u + face, edge, params.cube_surface_columns) + at);
            if !is_lit(r.albedo) {
                continue;
            }
            let s = read_record(r.albedo, r.normal, eye, cube::outward(face, cube::within_beside(at, edge)));
            let there = lights::look(light, s);
            if there.ahead && any(lights::unshadowed(light, s) > vec3f(0.0)) {
                last = mark(there, last, words);
            }
        }
    }
    workgroupBarrier();
    for (var word = lane; word < words; word += LANES) {
        shadow_reach[probe * words + word] = atomicLoad(&row[word]);
    }
}

/// Sets the bits of the squares of the texels round a place; if that is a single one, and the `last` one, it is set.
/// The one to pass on.
fn mark(there: lights::Look, last: u32, words: u32) -> u32 {
    let run = (lights::view_count() * SQUARES * SQUARES + 32u * words - 1u) / (32u * words);
    let size = lights::shadow.shadow_size;
    let most = vec2f(f32(size - 1u));
    let low = vec2u(clamp(floor(there.at - MARGIN), vec2f(0.0), most)) * SQUARES / size;
    let high = vec2u(clamp(floor(there.at + MARGIN) + 1.0, vec2f(0.0), most)) * SQUARES / size;
    let first = (there.view * SQUARES + low.y) * SQUARES + low.x;
    if all(low == high) && first == last {
        return last;
    }
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            let bit = ((there.view * SQUARES + y) * SQUARES + x) / run;
            atomicOr(&row[bit / 32u], 1u << (bit % 32u));
        }
    }
    return select(NONE, first, all(low == high));
}
