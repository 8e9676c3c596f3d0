//! The mean of what frames that show the same found of each pixel's light.
#define_import_path lightgraph::means
#import lightgraph::camera::camera

struct Mean {
    direct: vec4f,
    /// In alpha, of paths: the mean of their squares, each the sum of the channels.
    indirect: vec4f,
}

/// Where a pixel's mean stands.
fn place(pixel: vec2u) -> u32 {
    return pixel.y * camera.screen.x + pixel.x;
}
