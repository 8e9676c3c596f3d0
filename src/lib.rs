//! lightgraph: a data-driven render-graph framework.
//!
//! A render graph is a RON file, WGSL shaders stand beside it; a plan turns both into passes on a device.
//!
//! ```text
//! RON text ─graph─→ Graph ─plan─→ Plan ─gpu─→ images, times          `gpu` alone holds a device
//! WGSL text ─shader─→ Shader (module and interface)
//! glTF and scene RON ─scene─→ Scene (geometry, tables, facts)
//! ```
//!
//! - [`diag`]: places in texts, faults, how they are shown; `content` hashes what is compared, `lru` is a
//!   bounded cache, `parallel` works on all cores, `caches` keeps what can be made again, `caught` turns panics of
//!   other code into faults, [`files`] reads regular files up to a size
//! - [`value`]: values by name: parameters, facts, what a frame adds
//! - [`graph`]: the graph file: tree, expressions, variants, sub-graphs, repetitions, names, layout
//! - [`shader`]: composition, bindings, reflection, byte layouts
//! - [`scene`]: glTF, scene RON, poses, tables, a hierarchy of boxes over triangles, simplified triangles
//! - [`plan`]: wiring, liveness, sets and reductions, dirty bits, order, lifetimes and shared memory, where loops end,
//!   the inputs of each step and the fingerprints made from them, what changed, how much work it is
//! - [`gpu`]: device, memory, pipelines, execution, timing, readback, lists of dirty instances
//! - [`session`]: from files to frames; [`fastest`]: which of a graph's alternatives is, here; [`reload`]: files that
//!   change; [`verify`]: the proof that leaving steps out changes nothing
//! - [`image`]: EXR, PNG, texels of formats, files as textures of graphs, error metrics; [`math`]: the CPU twins of
//!   what shaders compute
//! - [`builtin`]: the graphs and shaders that the binary carries
//!
//! The command, its bench, tests of graphs, stress cases and window stand in `crates/cli`, on what is public here;
//! the server for editors in `crates/lsp`.
//!
//! What must stay true: no Rust names a rendering technique; only `gpu` and what calls it see a device; the executor
//! decides nothing; names are the wiring; what did not change is not run; the same inputs give the same bits on one
//! adapter; everything unknown is a fault, everything unused a warning; what users write never panics.
//!
//! # Use as a library
//!
//! ```no_run
//! use lightgraph::{diag::Checked, gpu::Gpu, scene, session::{Project, Session, Settings}};
//! use std::path::Path;
//!
//! fn main() -> Checked<()> {
//!     let gpu = Gpu::open()?;
//!     let project = Project::open(Path::new("graphs/gi/uniform_grid.ron"), &[])?;
//!     let scene = scene::load(Path::new("scenes/hall"))?.scene;
//!     let settings = Settings { size: [640, 480], skip: true, ..Settings::default() };
//!     let mut session = Session::new(&gpu, &project, scene, settings)?;
//!     session.frame(&gpu, 0, 0.0)?;
//!     let color = session.image(&gpu, "color")?;
//!     println!("{} × {} pixels", color.width, color.height);
//!     Ok(())
//! }
//! ```

#![forbid(unsafe_code)]

pub mod builtin;
#[doc(hidden)]
pub mod caches;
mod caught;
mod content;
pub mod diag;
#[cfg(feature = "gpu")]
pub mod fastest;
pub mod files;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod graph;
pub mod image;
mod lru;
pub mod math;
#[doc(hidden)]
pub mod parallel;
pub mod plan;
pub mod project;
#[cfg(not(target_arch = "wasm32"))]
pub mod reload;
pub mod scene;
#[cfg(feature = "gpu")]
pub mod session;
pub mod shader;
pub mod value;
#[cfg(feature = "gpu")]
pub mod verify;
