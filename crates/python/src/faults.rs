//! Faults of the library as Python's: `lightgraph.errors` says what they are there.

use lightgraph::internals::diag::{Severity, Span, render};
use lightgraph::{Checked, Diagnostic, Faults};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

/// The value, or the exception with all faults.
///
/// # Errors
/// `GraphError`, where there are faults.
pub fn raised<T>(py: Python<'_>, checked: Checked<T>) -> PyResult<T> {
    checked.map_err(|faults| exception(py, "GraphError", &faults))
}

/// The exception of that name for some faults.
pub fn exception(py: Python<'_>, class: &str, faults: &Faults) -> PyErr {
    let made = || {
        let class = py.import("lightgraph.errors")?.getattr(class)?;
        class.call1((faults.to_string(), listed(py, &faults.0)?))
    };
    match made() {
        Ok(error) => PyErr::from_value(error),
        Err(error) => error,
    }
}

/// Faults as a list of `lightgraph.errors.Fault`.
///
/// # Errors
/// Those of Python.
pub fn listed<'py>(py: Python<'py>, faults: &[Diagnostic]) -> PyResult<Bound<'py, PyList>> {
    let module = py.import("lightgraph.errors")?;
    let (fault, place) = (module.getattr("Fault")?, module.getattr("Place")?);
    let places = |d: &Diagnostic| {
        let all: Vec<_> = d.labels.iter().map(|(span, label)| placed(&place, span, label)).collect::<PyResult<_>>()?;
        PyTuple::new(py, all)
    };
    let one = |d: &Diagnostic| {
        let severity = match d.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
            Severity::Note => "note",
        };
        let shown = render(std::slice::from_ref(d));
        fault.call1((severity, &d.message, places(d)?, PyTuple::new(py, &d.help)?, shown))
    };
    PyList::new(py, faults.iter().map(one).collect::<PyResult<Vec<_>>>()?)
}

fn placed<'py>(place: &Bound<'py, PyAny>, span: &Span, label: &str) -> PyResult<Bound<'py, PyAny>> {
    let (from, to) = (span.source.line_column(span.start), span.source.line_column(span.end));
    place.call1((&span.source.path, from.0, from.1, to.0, to.1, span.text(), label))
}
