//! The modules of the library, without promise: any version may change them. The command, the server for editors, the
//! Python module, the page and the tests use them. A program uses the types of the [crate root](crate) alone.
//!
//! ```text
//! RON text ─graph─→ Graph ─plan─→ Plan ─gpu─→ images, times          `gpu` alone holds a device
//! WGSL text ─shader─→ Shader (module and interface)
//! glTF and scene RON ─scene─→ Scene (geometry, tables, facts)
//! ```
//!
//! - [`diag`]: places in texts, faults, how they are shown; [`files`] reads regular files up to a size, [`caches`] is
//!   the user's folder of caches, [`parallel`] works on all cores; private: `content` hashes, `lru` bounds a cache,
//!   `caught` turns panics of other code into faults
//! - [`value`]: values by name: parameters, facts, what a frame adds
//! - [`graph`]: the graph file: tree, expressions, variants, sub-graphs, repetitions, names, layout
//! - [`shader`]: composition, bindings, reflection, byte layouts
//! - [`scene`]: glTF, scene RON, poses, tables, a hierarchy of boxes over triangles, simplified triangles
//! - [`plan`]: wiring, liveness, sets and reductions, dirty bits, order, lifetimes and shared memory, where loops end,
//!   the inputs of each step and the fingerprints made from them, what changed, how much work it is
//! - [`project`]: a graph file with its shader folders; its faults, parameters, outputs
//! - [`image`]: EXR, PNG, texels of formats, files as textures of graphs, error metrics; [`math`]: the CPU twins of
//!   what shaders compute
//! - [`unused`]: what a graph declares and nothing uses
//! - [`builtin`]: the graphs and shaders that the binary carries; [`reload`]: files that change
//!
//! With the feature `gpu`:
//!
//! - [`gpu`]: device, memory, pipelines, execution, timing, readback, lists of dirty instances
//! - [`session`]: from files to frames; [`fastest`]: which of a graph's alternatives is, here; [`verify`]: the proof
//!   that leaving steps out changes nothing
//!
//! What must stay true: no Rust names a rendering technique; only what needs the feature `gpu` sees a device; the
//! executor decides nothing; names are the wiring; what did not change is not run; the same inputs give the same bits
//! on one adapter; everything unknown is a fault, everything unused a warning; what users write never panics.

#[path = "builtin.rs"]
pub mod builtin;
#[path = "caches.rs"]
pub mod caches;
#[path = "diag/mod.rs"]
pub mod diag;
#[cfg(feature = "gpu")]
#[path = "fastest/mod.rs"]
pub mod fastest;
#[path = "files.rs"]
pub mod files;
#[cfg(feature = "gpu")]
#[path = "gpu/mod.rs"]
pub mod gpu;
#[path = "graph/mod.rs"]
pub mod graph;
#[path = "image/mod.rs"]
pub mod image;
#[path = "math/mod.rs"]
pub mod math;
#[path = "parallel.rs"]
pub mod parallel;
#[path = "plan/mod.rs"]
pub mod plan;
#[path = "project.rs"]
pub mod project;
#[cfg(not(target_arch = "wasm32"))]
#[path = "reload.rs"]
pub mod reload;
#[path = "scene/mod.rs"]
pub mod scene;
#[cfg(feature = "gpu")]
#[path = "session/mod.rs"]
pub mod session;
#[path = "shader/mod.rs"]
pub mod shader;
#[path = "unused.rs"]
pub mod unused;
#[path = "value.rs"]
pub mod value;
#[cfg(feature = "gpu")]
#[path = "verify.rs"]
pub mod verify;
