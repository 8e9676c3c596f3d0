//! lightgraph in a browser: graphs, scenes and shaders held in memory, frames on the browser's device, images on a
//! canvas.
//!
//! - [`link`]: what a shared link holds
//! - `made`: from a wish to sessions; `engine`: from sessions to frames on the canvas; `looks`: how far images are
//!   apart, what resources hold; `tell`: what the page is told, as JSON
//!
//! The page (`page/`) runs the engine in a worker, so that neither a long plan nor a fault of the engine stops the
//! editor. Outside of a browser only [`link`] is built, for its tests.

#![forbid(unsafe_code)]

#[cfg(target_arch = "wasm32")]
mod engine;
pub mod link;
#[cfg(target_arch = "wasm32")]
mod looks;
#[cfg(target_arch = "wasm32")]
mod made;
#[cfg(target_arch = "wasm32")]
mod tell;
