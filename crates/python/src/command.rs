//! The `lightgraph` command, which comes with the package.

use crate::faults::exception;
use clap::Parser;
use lightgraph::Faults;
use lightgraph_cli::commands::{self, Cli, Failure};
use pyo3::prelude::*;

fn parsed(words: Vec<String>) -> Result<Cli, clap::Error> {
    Cli::try_parse_from(std::iter::once("lightgraph".to_string()).chain(words))
}

/// Runs the command as a shell does. Returns its exit code.
#[pyfunction]
pub fn command(py: Python<'_>, words: Vec<String>) -> u8 {
    py.detach(|| match parsed(words) {
        Ok(cli) => commands::run(&cli),
        Err(e) => {
            // A closed stream leaves nobody to tell.
            let _ = e.print();
            u8::try_from(e.exit_code()).unwrap_or(2)
        }
    })
}

/// Runs the command, with faults as exceptions. Returns its exit code.
#[pyfunction]
pub fn attempt(py: Python<'_>, words: Vec<String>) -> PyResult<u8> {
    let cli = parsed(words).map_err(|e| pyo3::exceptions::PyValueError::new_err(e.to_string()))?;
    py.detach(|| commands::attempt(&cli)).map_err(|failure| match failure {
        Failure::NoAdapter(d) => exception(py, "NoAdapterError", &d.into()),
        other => exception(py, "GraphError", &Faults::from(other)),
    })
}
