//! A scene that renderers look at.

use crate::faults::{listed, raised};
use crate::values::{image, value};
use lightgraph::Diagnostic;
use lightgraph::internals::scene::{self, Environment, Loaded};
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::Arc;

/// A scene, never changed: any number of renderers share it.
#[pyclass(frozen, name = "Scene", module = "lightgraph._native")]
pub struct SharedScene {
    pub scene: Arc<scene::Scene>,
    notices: Vec<Diagnostic>,
}

impl From<Loaded> for SharedScene {
    fn from(loaded: Loaded) -> SharedScene {
        SharedScene { scene: Arc::new(loaded.scene), notices: loaded.notices }
    }
}

#[pymethods]
impl SharedScene {
    /// Reads a scene's files.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<SharedScene> {
        let loaded = py.detach(|| lightgraph::Scene::load(&path));
        raised(py, loaded).map(SharedScene::from)
    }

    /// A scene from the bytes of a glTF that needs no other file, and the text of a scene RON.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8], name: &str, description: Option<&str>) -> PyResult<SharedScene> {
        let loaded = py.detach(|| lightgraph::Scene::from_bytes(bytes, name, description));
        raised(py, loaded).map(SharedScene::from)
    }

    /// The same scene in the light of a panorama, (height, 2 × height, 3).
    fn lit_by(&self, py: Python<'_>, panorama: PyReadonlyArrayDyn<'_, f32>) -> PyResult<SharedScene> {
        let image = image("the panorama", &panorama)?;
        let made = py.detach(|| {
            let environment = Environment::panorama(&image)?;
            let scene = scene::Scene { environment: Some(environment), ..(*self.scene).clone() };
            Ok(SharedScene { scene: Arc::new(scene), notices: self.notices.clone() })
        });
        raised(py, made)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Opposite corners, in the file's coordinates.
    #[getter]
    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let (b, o) = (self.scene.bounds, self.scene.origin);
        ((b.min + o).to_array(), (b.max + o).to_array())
    }

    #[getter]
    fn nodes(&self) -> Vec<&str> {
        self.scene.nodes.iter().map(|n| n.name.as_str()).collect()
    }

    #[getter]
    fn lights(&self) -> Vec<&str> {
        self.scene.lights.iter().map(|l| l.name.as_str()).collect()
    }

    #[getter]
    fn cameras(&self) -> Vec<&str> {
        self.scene.cameras.iter().map(|c| c.name.as_str()).collect()
    }

    #[getter]
    fn duration(&self) -> f32 {
        self.scene.duration()
    }

    /// What graphs may ask of it, by name.
    fn facts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let facts = PyDict::new(py);
        for (name, v) in self.scene.facts() {
            facts.set_item(name, value(py, &v)?)?;
        }
        Ok(facts)
    }

    #[getter]
    fn notices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        listed(py, &self.notices)
    }
}
