//! The Python module `lightgraph._native`, which the package in `python/` wraps.

/// What the package `lightgraph` is made from.
#[pyo3::pymodule]
mod _native {
    use pyo3::prelude::*;

    /// The version of the library, as `0.1.0`.
    #[pyfunction]
    fn version() -> &'static str {
        env!("CARGO_PKG_VERSION")
    }
}
