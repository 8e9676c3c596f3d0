//! The native half of the Python package `lightgraph`: frames, scenes and plans of the library, as plain as they can
//! be. What people use, with its documentation, is the Python in `python/lightgraph`.
//!
//! - `faults`: faults of the library as Python's exceptions; `values`: what goes from one language to the other
//! - `device`: the adapter that renderers share; `scene`, `plan`; `renderer`: a session and its frames, `flight` those
//!   under way
//! - `tools`: checks and comparisons without a renderer; `command`: the `lightgraph` command
//!
//! What must stay true: the interpreter's lock is let go wherever work is done; no lock of ours is held while it is
//! taken.

#![forbid(unsafe_code)]

mod command;
mod device;
mod faults;
mod flight;
mod plan;
mod renderer;
mod scene;
mod tools;
mod values;

/// What the package `lightgraph` is made from.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::command::{attempt, command};
    #[pymodule_export]
    use crate::device::{adapter, drain};
    #[pymodule_export]
    use crate::flight::FrameInFlight;
    #[pymodule_export]
    use crate::plan::SharedPlan;
    #[pymodule_export]
    use crate::renderer::Renderer;
    #[pymodule_export]
    use crate::scene::SharedScene;
    #[pymodule_export]
    use crate::tools::{allow_outside, builtin_files, check, compare, flip, outputs, parameters, read, version, write};
}
