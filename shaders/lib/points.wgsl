//! Points of the image that rays leave, for the pixels that share them.
#define_import_path lightgraph::points
#import lightgraph::tiles::{NO_POINT, TILE, points_across}

/// Where each lies, and its normal; NO_POINT in the last word where a tile has none.
var<storage, read> points: array<vec4u>;

/// Whether the tile of a pixel has one in this frame.
fn has_point(pixel: vec2u) -> bool {
    let tile = pixel / TILE;
    return points[tile.y * points_across().x + tile.x].w != NO_POINT;
}
