//! Chance that is another one in each frame that shows the same as the one before.
#define_import_path lightgraph::rounds

/// One texel: how many frames before this one show the same. See count_still.wgsl.
var still_frames: texture_2d<u32>;

/// How many frames before this one show the same.
fn round() -> u32 {
    return textureLoad(still_frames, vec2u(0u), 0).r;
}

/// What seeds differ by from round to round: 0 in the first.
fn salt() -> u32 {
    return round() * 0x9e3779b9u;
}
