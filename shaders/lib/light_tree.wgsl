//! A binary tree over the lights that stand somewhere: groups of lights near each other, and groups of groups
//! (Walter et al., "Lightcuts: A Scalable Approach to Illumination", SIGGRAPH 2005).
//!
//! Row 1 is the group of all; the halves of row i are rows 2i and 2i + 1; from row `light_leaves` on, a power of two,
//! rows are single lights. light_tree.wgsl puts them in a texture, TEXELS texels a row, and after the lights of the
//! last rows come the directional ones, which are in no group.
#define_import_path lightgraph::light_tree
#import lightgraph::lights::Light

const TEXELS: u32 = 6u;
/// Rows in a row of the texture.
const ACROSS: u32 = 256u;

struct Node {
    /// The light that stands for the group: as bright as all, from their middle, else as one of them.
    light: Light,
    /// The box that holds the lights; lower above upper for none.
    lower: vec3f,
    upper: vec3f,
    /// Where the one stands. Shadows are traced to it.
    representative: vec3f,
}

/// The first texel of a row.
fn place(row: u32) -> vec2u {
    return vec2u(row % ACROSS * TEXELS, row / ACROSS);
}
