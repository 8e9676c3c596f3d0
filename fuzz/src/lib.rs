//! What is done with hostile input, one function a kind: `cargo fuzz` and the tests of the package call the same.
//!
//! Each returns; a panic, an abort, endless work or memory beyond the limit is what is looked for.

mod targets;

pub use targets::{cache, gltf, graph, image, plan, results, scene, test, variant, wgsl};
