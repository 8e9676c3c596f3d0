//! A session, and what it remembers from frame to frame.

mod seen;
mod stats;

use crate::device::{Device, usable};
use crate::faults::{listed, raised};
use crate::flight::FrameInFlight;
use crate::plan::SharedPlan;
use crate::scene::SharedScene;
use crate::values;
use lightgraph::internals::gpu::{upload_bytes, upload_image};
use lightgraph::internals::plan::keys::Version;
use lightgraph::internals::plan::{Desc, tables};
use lightgraph::internals::scene::CameraPose;
use lightgraph::{Checked, Diagnostic, Faults, FrameReport, Image, Project, Session, Settings, View};
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A graph on a scene, frame by frame.
#[pyclass(frozen, module = "lightgraph._native")]
pub struct Renderer {
    device: Device,
    // Locked only while the interpreter's lock is let go.
    state: Mutex<RendererState>,
    /// By output: what it held when it was read last, and what was given out. Locked for moments only.
    given: Mutex<BTreeMap<String, (Version, Py<PyAny>)>>,
}

struct RendererState {
    project: Project,
    session: Session,
    /// The number of the next frame.
    number: u32,
    /// Of the last frame, in seconds.
    time: f32,
    report: FrameReport,
    /// Milliseconds of the library's whole call; `None` for one that was not waited for.
    call_ms: Option<f64>,
    /// Versions of what is lent.
    lent: u64,
    /// The next frame's own: what was found when the session was made.
    fresh: Vec<Diagnostic>,
}

/// What is read of an output.
enum OutputContent {
    Image(Image),
    Words(Vec<u32>),
    /// The same as before.
    Same,
}

type VersionedOutputs = Vec<(String, Option<Version>, OutputContent)>;

impl RendererState {
    /// Puts another session in place of this one; where it can't be made, everything stays as it is.
    fn replace(&mut self, device: &Device, project: Option<Project>, settings: Settings) -> Checked<()> {
        let project = project.unwrap_or_else(|| self.project.clone());
        let scene = self.session.scene.clone();
        let mut session = Session::after(&device.gpu, &project, scene, settings, Some(&self.session))?;
        session.shift = self.session.shift.clone();
        self.fresh.extend(session.notices.iter().cloned());
        self.project = project;
        self.session = session;
        Ok(())
    }

    /// Makes the plan give these outputs, besides those that it gives.
    fn ask_for(&mut self, device: &Device, outputs: &[String]) -> Checked<()> {
        let there = self.session.settings.outputs.clone().unwrap_or_default();
        let missing: Vec<&String> = outputs.iter().filter(|o| !there.contains(o)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let mut project = self.project.clone();
        let exposed = missing.iter().map(|name| project.expose(name));
        together(exposed)?;
        let all = there.iter().chain(missing).cloned().collect();
        let settings = Settings { outputs: Some(all), ..self.session.settings.clone() };
        self.replace(device, Some(project), settings)
    }

    fn begin(&mut self, device: &Device, time: Option<f32>, outputs: Option<&[String]>) -> Checked<(u32, f32)> {
        device.check()?;
        if let Some(outputs) = outputs {
            self.ask_for(device, outputs)?;
        }
        let time = time.unwrap_or(self.time);
        self.session.retime(&device.gpu, &self.project, time)?;
        Ok((self.number, time))
    }

    fn end(&mut self, time: f32, call_ms: Option<f64>) {
        self.call_ms = call_ms;
        self.number = self.number.wrapping_add(1);
        self.time = time;
    }

    fn names(&self, outputs: Option<Vec<String>>) -> Vec<String> {
        outputs.or_else(|| self.session.settings.outputs.clone()).unwrap_or_default()
    }

    /// What outputs hold that is not known already.
    fn read(
        &self,
        device: &Device,
        names: Vec<String>,
        known: &BTreeMap<String, Version>,
    ) -> Checked<VersionedOutputs> {
        let read = |name: String| {
            let version = self.session.version(&name)?;
            let content = if version.is_some() && version.as_ref() == known.get(&name) {
                OutputContent::Same
            } else if self.is_buffer(&name)? {
                OutputContent::Words(self.session.words(&device.gpu, &name)?)
            } else {
                OutputContent::Image(self.session.image(&device.gpu, &name)?)
            };
            Ok((name, version, content))
        };
        names.into_iter().map(read).collect()
    }

    fn is_buffer(&self, output: &str) -> Checked<bool> {
        let id = self.session.output(output)?;
        Ok(matches!(self.session.plan.resources[id.0].desc, Desc::Buffer { .. }))
    }
}

/// All faults of several tries.
fn together(all: impl Iterator<Item = Checked<()>>) -> Checked<()> {
    Faults::check(all.filter_map(Result::err).flat_map(|f| f.0).collect(), ())
}

impl Renderer {
    fn state(&self) -> MutexGuard<'_, RendererState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does something with the state, without the interpreter's lock.
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut RendererState) -> Checked<T> + Send) -> PyResult<T> {
        usable(py, &self.device)?;
        let done = py.detach(|| work(&mut self.state()));
        raised(py, done)
    }

    fn given(&self) -> MutexGuard<'_, BTreeMap<String, (Version, Py<PyAny>)>> {
        self.given.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was given out, by output.
    fn known(&self, py: Python<'_>) -> BTreeMap<String, (Version, Py<PyAny>)> {
        self.given().iter().map(|(name, (version, array))| (name.clone(), (*version, array.clone_ref(py)))).collect()
    }
}

#[pymethods]
impl Renderer {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "Python's side of it has keywords and defaults")]
    fn new(
        py: Python<'_>,
        graph: PathBuf,
        scene: Option<&SharedScene>,
        size: [u32; 2],
        params: Vec<String>,
        outputs: Option<Vec<String>>,
        camera: Option<String>,
        shaders: Vec<PathBuf>,
        adapter: Option<String>,
        checks: (bool, bool, bool),
    ) -> PyResult<Renderer> {
        let (skip, verify, watch) = checks;
        let device = Device::open(py, adapter)?;
        let scene = scene.map(|s| s.scene.clone());
        let made = py.detach(|| {
            let mut project = Project::open(&graph, &shaders)?;
            let params = project.params(&params)?;
            let outputs = outputs.unwrap_or_else(|| project.main_output().map(String::from).into_iter().collect());
            together(outputs.iter().map(|name| project.expose(name)))?;
            let none = scene.is_none();
            let scene = match scene {
                Some(scene) => scene,
                None => lightgraph::Scene::stand_in()?.scene.into(),
            };
            if let Some(camera) = &camera {
                scene.find_camera(camera)?;
            }
            let settings =
                Settings { params, size, camera, outputs: Some(outputs), skip, verify, watch, ..Settings::default() };
            let session = Session::new(&device.gpu, &project, scene, settings)?;
            if let Some(how) = tables::scene_use(&project.graph, &session.plan).filter(|_| none) {
                let d = Diagnostic::error(format!("the graph needs a scene: {how}"));
                return Err(d.help("give one: `Renderer(graph, \"scene.glb\")`").into());
            }
            let fresh = session.notices.clone();
            let report = FrameReport::default();
            Ok(RendererState { project, session, number: 0, time: 0.0, report, call_ms: None, lent: 0, fresh })
        });
        let state = Mutex::new(raised(py, made)?);
        Ok(Renderer { device, state, given: Mutex::default() })
    }

    /// Renders a frame and waits for it. By output, what it holds.
    fn frame<'py>(
        &self,
        py: Python<'py>,
        time: Option<f32>,
        outputs: Option<Vec<String>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let known = self.known(py);
        let versions: BTreeMap<String, Version> = known.iter().map(|(name, (v, _))| (name.clone(), *v)).collect();
        let given = self.with(py, |state| {
            let (number, time) = state.begin(&self.device, time, outputs.as_deref())?;
            let start = Instant::now();
            let report = state.session.frame(&self.device.gpu, number, time)?;
            state.end(time, Some(start.elapsed().as_secs_f64() * 1e3));
            let failed = state.session.failed_checks(&report);
            state.fresh.extend(report.warnings.iter().cloned());
            state.report = report;
            Faults::check(failed, ())?;
            let names = state.names(outputs);
            state.read(&self.device, names, &versions)
        })?;
        let frame = PyDict::new(py);
        for (name, version, content) in given {
            let array = match (content, known.get(&name)) {
                (OutputContent::Image(image), _) => values::array(py, image)?,
                (OutputContent::Words(words), _) => values::words(py, words)?,
                (OutputContent::Same, Some((_, array))) => array.bind(py).clone(),
                (OutputContent::Same, None) => continue,
            };
            frame.set_item(&name, &array)?;
            if let Some(version) = version {
                self.given().insert(name, (version, array.unbind()));
            }
        }
        Ok(frame)
    }

    /// Begins a frame and waits for nothing.
    fn submit(&self, py: Python<'_>, time: Option<f32>, outputs: Option<Vec<String>>) -> PyResult<FrameInFlight> {
        let known = self.known(py);
        let (recorded, images, same) = self.with(py, |state| {
            let gpu = &self.device.gpu;
            let (number, time) = state.begin(&self.device, time, outputs.as_deref())?;
            let names = state.names(outputs);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let recorded = state.session.record(gpu, &mut encoder, number, time)?;
            let (mut images, mut same) = (vec![], vec![]);
            for name in names {
                let version = state.session.version(&name)?;
                if version.is_some() && version == known.get(&name).map(|k| k.0) {
                    same.push(name);
                } else {
                    let image = state.session.image_later(gpu, &mut encoder, &name)?;
                    images.push((name, image));
                }
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.poll()?;
            state.end(time, None);
            Ok((recorded, images, same))
        })?;
        let same = same.into_iter().filter_map(|name| Some((name.clone(), known.get(&name)?.1.clone_ref(py))));
        Ok(FrameInFlight::new(self.device.clone(), recorded, images, same.collect()))
    }

    /// Sets parameters, by `NAME=VALUE`; all of them or, after a fault, none.
    fn set(&self, py: Python<'_>, params: Vec<String>) -> PyResult<()> {
        self.with(py, |state| {
            let mut settings = state.session.settings.clone();
            settings.params.extend(state.project.params(&params)?);
            if settings.params == state.session.settings.params {
                return Ok(());
            }
            state.replace(&self.device, None, settings)
        })
    }

    /// By parameter: its value.
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = self.with(py, |state| {
            let plan = &state.session.plan;
            Ok(plan.params.iter().filter_map(|n| Some((n.clone(), plan.value(n)?))).collect::<Vec<_>>())
        })?;
        let params = PyDict::new(py);
        for (name, v) in all {
            params.set_item(name, values::value(py, &v)?)?;
        }
        Ok(params)
    }

    fn size(&self, py: Python<'_>) -> PyResult<[u32; 2]> {
        self.with(py, |state| Ok(state.session.settings.size))
    }

    fn resize(&self, py: Python<'_>, size: [u32; 2]) -> PyResult<()> {
        self.with(py, |state| {
            let settings = Settings { size, ..state.session.settings.clone() };
            state.replace(&self.device, None, settings)
        })
    }

    /// The outputs that frames give, and all that the graph has.
    fn outputs(&self, py: Python<'_>) -> PyResult<(Vec<String>, Vec<String>)> {
        self.with(py, |state| {
            let all = state.project.graph.outputs.iter().map(|o| o.0.value.clone()).collect();
            Ok((state.names(None), all))
        })
    }

    /// By input: its bytes of a buffer, or format, layers, height and width of a texture.
    fn inputs(&self, py: Python<'_>) -> PyResult<BTreeMap<String, (String, Vec<u64>)>> {
        self.with(py, |state| {
            let plan = &state.session.plan;
            let shape = |desc: &Desc| match desc {
                Desc::Buffer { size, .. } => ("buffer".to_owned(), vec![*size]),
                Desc::Texture(t) => (format!("{:?}", t.format), [t.layers, t.height, t.width].map(u64::from).to_vec()),
            };
            let resources = plan.inputs.iter().filter_map(|id| plan.resources.get(id.0));
            Ok(resources.map(|r| (r.name.clone(), shape(&r.desc))).collect())
        })
    }

    /// Lends an image to an input.
    fn lend_image(&self, py: Python<'_>, input: String, array: PyReadonlyArrayDyn<'_, f32>) -> PyResult<()> {
        let image = values::image(&format!("what is given as `{input}`"), &array)?;
        self.lend(py, &input, |desc| upload_image(&self.device.gpu, desc, &input, &image))
    }

    /// Lends bytes to an input that is a buffer.
    fn lend_bytes(&self, py: Python<'_>, input: String, bytes: Bound<'_, PyBytes>) -> PyResult<()> {
        let bytes = bytes.as_bytes();
        self.lend(py, &input, |desc| upload_bytes(&self.device.gpu, desc, &input, bytes))
    }

    /// Makes the next frame run everything, with the number 0.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |state| {
            state.session.forget();
            (state.number, state.time) = (0, 0.0);
            Ok(())
        })
    }

    /// What the last frame took, as JSON would say it.
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let stats = self.with(py, |state| Ok(stats::stats(&self.device, state)))?;
        values::json(py, &stats)
    }

    fn plan(&self, py: Python<'_>) -> PyResult<SharedPlan> {
        self.with(py, |state| Ok(SharedPlan(state.session.plan.clone())))
    }

    /// What there is to say since this was asked last.
    fn notices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let fresh = self.with(py, |state| Ok(std::mem::take(&mut state.fresh)))?;
        listed(py, &fresh)
    }

    fn move_by(&self, py: Python<'_>, name: String, by: [f32; 3]) -> PyResult<()> {
        self.with(py, |state| seen::shift(&mut state.session, &name, seen::Movement::By(by.into()), state.time))
    }

    fn move_to(&self, py: Python<'_>, name: String, to: [f32; 3]) -> PyResult<()> {
        self.with(py, |state| seen::shift(&mut state.session, &name, seen::Movement::To(to.into()), state.time))
    }

    /// Puts nodes where matrices say, column by column.
    fn place(&self, py: Python<'_>, all: Vec<(String, [f32; 16])>) -> PyResult<()> {
        self.with(py, |state| seen::place(&mut state.session, &all))
    }

    /// Shows another scene, seen as before. What was found from earlier frames is forgotten; the next one has the
    /// number 0.
    fn show(&self, py: Python<'_>, scene: &SharedScene) -> PyResult<()> {
        let scene = scene.scene.clone();
        self.with(py, |state| {
            let settings = state.session.settings.clone();
            let before = state.session.scene.clone();
            if let Some(name) = &settings.camera {
                scene.find_camera(name)?;
            }
            let mut session = Session::after(&self.device.gpu, &state.project, scene, settings, Some(&state.session))?;
            session.shift.view = state.session.shift.view.map(|view| {
                let position = view.place.position + before.origin - session.scene.origin;
                View { place: CameraPose { position, ..view.place }, ..view }
            });
            session.forget();
            state.fresh.extend(session.notices.iter().cloned());
            (state.session, state.number) = (session, 0);
            Ok(())
        })
    }

    fn position(&self, py: Python<'_>, name: String) -> PyResult<[f32; 3]> {
        self.with(py, |state| seen::position(&state.session, &name, state.time))
    }

    /// Sees through a camera of the scene; without a name through the default one.
    fn look_through(&self, py: Python<'_>, camera: Option<String>) -> PyResult<()> {
        self.with(py, |state| seen::look_through(&mut state.session, camera))
    }

    /// Sees from a place towards another.
    fn look(&self, py: Python<'_>, look: seen::CameraTuple) -> PyResult<()> {
        self.with(py, |state| seen::look(&mut state.session, &look))
    }

    /// What is seen.
    fn seen(&self, py: Python<'_>) -> PyResult<seen::CameraTuple> {
        self.with(py, |state| seen::seen(&state.session, state.time))
    }
}

impl Renderer {
    fn lend(
        &self,
        py: Python<'_>,
        input: &str,
        memory: impl FnOnce(&Desc) -> Checked<lightgraph::Memory> + Send,
    ) -> PyResult<()> {
        self.with(py, |state| {
            let id = state.session.input(input)?;
            let memory = memory(&state.session.plan.resources[id.0].desc)?;
            state.lent += 1;
            state.session.import(&self.device.gpu, input, memory, state.lent)
        })
    }
}
