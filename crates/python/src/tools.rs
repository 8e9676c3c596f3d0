//! What needs no renderer.

use crate::faults::{listed, raised};
use crate::scene::SharedScene;
use crate::values::{array, image, json, value};
use lightgraph::internals::diag;
use lightgraph::internals::image::exr::{Precision, read_exr, write_exr};
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::internals::image::{flip as hdr_flip, metrics};
use lightgraph::internals::plan::request::all_sample_facts;
use lightgraph::internals::{builtin, files};
use lightgraph::{Diagnostic, Faults, Project};
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The version of the library, as `0.1.0`.
#[pyfunction]
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Lets scenes and graphs name files outside of their folder, from now on.
#[pyfunction]
pub fn allow_outside() {
    files::allow_outside();
}

/// The names of the graphs and shaders that come with the library.
#[pyfunction]
pub fn builtin_files() -> Vec<&'static str> {
    builtin::FILES.iter().map(|f| f.0).collect()
}

/// The faults and warnings of a graph.
#[pyfunction]
pub fn check<'py>(
    py: Python<'py>,
    graph: PathBuf,
    scene: Option<&SharedScene>,
    params: Vec<String>,
    strict: bool,
    shaders: Vec<PathBuf>,
) -> PyResult<Bound<'py, PyList>> {
    let facts = scene.map_or_else(all_sample_facts, |s| vec![s.scene.facts()]);
    let found = py.detach(|| match Project::open(&graph, &shaders) {
        Err(Faults(faults)) => Ok(faults),
        Ok(project) => project.params(&params).map(|params| project.faults(&params, &facts)),
    });
    let mut faults: Vec<Diagnostic> = raised(py, found)?;
    if strict {
        diag::strict(&mut faults);
    }
    listed(py, &faults)
}

/// By parameter of a graph: type, default, least, most, and what it is about.
#[pyfunction]
pub fn parameters<'py>(py: Python<'py>, graph: PathBuf, shaders: Vec<PathBuf>) -> PyResult<Bound<'py, PyDict>> {
    let opened = py.detach(|| Project::open(&graph, &shaders));
    let project = raised(py, opened)?;
    let all = PyDict::new(py);
    for (name, param) in &project.graph.params {
        let bound = |v: &Option<_>| v.as_ref().map(|v| value(py, v)).transpose();
        let (least, most) = (bound(&param.min)?, bound(&param.max)?);
        all.set_item(&name.value, (param.ty.wgsl(), value(py, &param.default)?, least, most, &param.about))?;
    }
    Ok(all)
}

/// The outputs of a graph.
#[pyfunction]
pub fn outputs(py: Python<'_>, graph: PathBuf, shaders: Vec<PathBuf>) -> PyResult<Vec<String>> {
    let opened = py.detach(|| Project::open(&graph, &shaders));
    let project = raised(py, opened)?;
    Ok(project.graph.outputs.into_iter().map(|(name, _)| name.value).collect())
}

/// How far an image is from a reference, as numbers by name.
#[pyfunction]
pub fn compare<'py>(
    py: Python<'py>,
    test: PyReadonlyArrayDyn<'py, f32>,
    reference: PyReadonlyArrayDyn<'py, f32>,
    mask: Option<Vec<bool>>,
) -> PyResult<Bound<'py, PyAny>> {
    let (test, reference) = (image("the image", &test)?, image("the reference", &reference)?);
    let found = py.detach(|| metrics::compare(&test, &reference, mask.as_deref()));
    let found = serde_json::to_value(raised(py, found)?);
    json(py, &found.unwrap_or_default())
}

/// The mean HDR-FLIP error.
#[pyfunction]
pub fn flip<'py>(
    py: Python<'py>,
    test: PyReadonlyArrayDyn<'py, f32>,
    reference: PyReadonlyArrayDyn<'py, f32>,
    mask: Option<Vec<bool>>,
) -> PyResult<f64> {
    let (test, reference) = (image("the image", &test)?, image("the reference", &reference)?);
    let found = py.detach(|| hdr_flip::flip(&test, &reference, mask.as_deref()));
    raised(py, found)
}

/// The image of an OpenEXR file.
#[pyfunction]
pub fn read(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let found = py.detach(|| read_exr(&path));
    array(py, raised(py, found)?)
}

/// Writes an image as OpenEXR, or as PNG where the path ends so, with so many stops of exposure.
#[pyfunction]
pub fn write(py: Python<'_>, path: PathBuf, pixels: PyReadonlyArrayDyn<'_, f32>, exposure: f32) -> PyResult<()> {
    let pixels = image("the image", &pixels)?;
    let png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    let metadata = BTreeMap::new();
    let done = py.detach(|| match png {
        true => write_png(&path, &pixels, ToneMap::default(), exposure, &metadata),
        false => write_exr(&path, &[("", &pixels)], Precision::Float, &metadata),
    });
    raised(py, done)
}
