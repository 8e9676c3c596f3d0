//! Chance that is another one in each frame that shows the same as the one before.
#define_import_path lightgraph::rounds
#import lightgraph::progress::Progress

/// One texel: what progress.wgsl has counted, for shaders that have no room for another buffer.
var progress_texel: texture_2d<u32>;

fn counted() -> Progress {
    let texel = textureLoad(progress_texel, vec2u(0u), 0);
    return Progress(texel.r, texel.g, texel.b, texel.a);
}

/// How many frames before this one show the same.
fn round() -> u32 {
    return counted().round;
}

/// What seeds differ by from round to round: 0 in the first.
fn salt() -> u32 {
    return round() * 0x9e3779b9u;
}
