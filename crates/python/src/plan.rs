//! What a graph compiles to.

use crate::values::json;
use lightgraph::internals::plan;
use lightgraph_cli::show;
use pyo3::prelude::*;

/// A plan as it was when it was asked for.
#[pyclass(frozen, name = "Plan", module = "lightgraph._native")]
pub struct SharedPlan(pub plan::Plan);

#[pymethods]
impl SharedPlan {
    fn text(&self) -> String {
        self.0.to_string()
    }

    fn svg(&self) -> String {
        show::to_svg(&self.0)
    }

    fn dot(&self) -> String {
        show::to_dot(&self.0)
    }

    fn json<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json(py, &show::to_json(&self.0))
    }

    /// Bytes of textures and buffers as they are allocated, and as they would be if nothing shared memory.
    #[getter]
    fn bytes(&self) -> (u64, u64) {
        self.0.bytes()
    }
}
