//! Points from which rays are gathered: one lit pixel of each square tile of the image, if it has any.
#define_import_path lightgraph::tiles
#import lightgraph::camera::camera
#import lightgraph::random::seed
#import lightgraph::rounds::frame
#import lightgraph::seen::seen_at
#import lightgraph::surface::is_lit

/// Pixels along a tile.
const TILE: u32 = #{TILE}u;

/// A prime: pixels of a tile take turns, and none is left out.
const STRIDE: u32 = 7919u;

/// No normal packs to it.
const NO_POINT: u32 = 0x80008000u;

/// In place of the doubt of a point: where there is nothing to light, and where a tile waits for its turn.
const NO_DOUBT: f32 = -1.0;
const WAITS: f32 = -2.0;

fn points_across() -> vec2u {
    return (camera.screen + TILE - 1u) / TILE;
}

/// The pixel of a tile, another one in each frame: any, but in a tile with lit pixels a lit one.
fn point_pixel(tile: vec2u) -> vec2u {
    // A tile that waits has its turn every fourth frame.
    let turn = frame() + frame() / 4u;
    let first = (seed(tile, 77u) + turn * STRIDE) % (TILE * TILE);
    var pixel = vec2u(0u);
    for (var i = 0u; i < TILE * TILE; i++) {
        let k = (first + i) % (TILE * TILE);
        pixel = min(tile * TILE + vec2u(k % TILE, k / TILE), camera.screen - 1u);
        if is_lit(seen_at(pixel).albedo) {
            break;
        }
    }
    return pixel;
}
