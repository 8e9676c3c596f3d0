//! Chance that is another one in each frame that shows the same scene as the one before.
#define_import_path lightgraph::rounds
#import lightgraph::progress::Progress

/// One texel: what progress.wgsl has counted, for shaders that have no room for another buffer.
var progress_texel: texture_2d<u32>;

/// Without the hashes.
fn counted() -> Progress {
    let texel = textureLoad(progress_texel, vec2u(0u), 0);
    return Progress(texel.r, texel.g, 0u, texel.b, 0u, texel.a);
}

/// How many frames before this one show the same.
fn round() -> u32 {
    return counted().round;
}

/// How many frames before this one show the same scene, from wherever.
fn frame() -> u32 {
    return counted().frame;
}

/// What seeds differ by from frame to frame: 0 in the first.
fn salt() -> u32 {
    return frame() * 0x9e3779b9u;
}
