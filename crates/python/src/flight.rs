//! A frame that the device works on.

use crate::device::{Device, usable};
use crate::faults::raised;
use crate::values::array;
use lightgraph::internals::gpu::PendingImage;
use lightgraph::{Checked, Diagnostic, Frame, FrameReport, Gpu, Image};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// What is asked for again and again, while the device works.
const NAP: Duration = Duration::from_micros(100);

/// A frame under way. It needs neither its renderer nor the scene any more.
#[pyclass(frozen, name = "Flight", module = "lightgraph._native")]
pub struct FrameInFlight {
    device: Device,
    state: Mutex<FlightState>,
    /// Outputs that are the same as before.
    known: Vec<(String, Py<PyAny>)>,
}

struct FlightState {
    recorded: Frame,
    report: Option<FrameReport>,
    images: Vec<(String, PendingOutput)>,
    /// What was found wrong, for whoever asks again.
    failed: Option<lightgraph::Faults>,
}

enum PendingOutput {
    Under(PendingImage),
    There(Image),
    Taken,
}

impl FlightState {
    /// Whether everything has arrived. Never waits.
    fn arrived(&mut self, gpu: &Gpu) -> Checked<bool> {
        if let Some(faults) = &self.failed {
            return Err(faults.clone());
        }
        let arrived = self.look(gpu);
        if let Err(faults) = &arrived {
            self.failed = Some(faults.clone());
        }
        arrived
    }

    fn look(&mut self, gpu: &Gpu) -> Checked<bool> {
        if self.report.is_none() {
            self.report = self.recorded.arrived(gpu)?;
        }
        let mut all = self.report.is_some();
        for (_, image) in &mut self.images {
            if let PendingOutput::Under(under) = image {
                match under.arrived(gpu)? {
                    Some(there) => *image = PendingOutput::There(there),
                    None => all = false,
                }
            }
        }
        Ok(all)
    }

    fn wait(&mut self, gpu: &Gpu) -> Checked<()> {
        let start = Instant::now();
        while !self.arrived(gpu)? {
            if start.elapsed() > gpu.patience {
                let d = Diagnostic::error(format!("the device does not answer within {:?}", gpu.patience));
                return Err(d.help("look for a loop in a shader that does not end").into());
            }
            std::thread::sleep(NAP);
        }
        Ok(())
    }
}

impl FrameInFlight {
    pub fn new(
        device: Device,
        recorded: Frame,
        images: Vec<(String, PendingImage)>,
        known: Vec<(String, Py<PyAny>)>,
    ) -> FrameInFlight {
        let images = images.into_iter().map(|(name, image)| (name, PendingOutput::Under(image))).collect();
        FrameInFlight { device, state: Mutex::new(FlightState { recorded, report: None, images, failed: None }), known }
    }
}

#[pymethods]
impl FrameInFlight {
    /// Whether the result is there.
    fn ready(&self, py: Python<'_>) -> PyResult<bool> {
        usable(py, &self.device)?;
        let found = py.detach(|| self.state.lock().unwrap_or_else(PoisonError::into_inner).arrived(&self.device.gpu));
        raised(py, found)
    }

    /// Waits for the frame. By output, its image; empty when they were taken before.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        usable(py, &self.device)?;
        let found = py.detach(|| {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            state.wait(&self.device.gpu)?;
            let taken =
                |(name, image): &mut (String, PendingOutput)| match std::mem::replace(image, PendingOutput::Taken) {
                    PendingOutput::There(image) => Some((name.clone(), image)),
                    PendingOutput::Under(_) | PendingOutput::Taken => None,
                };
            Ok(state.images.iter_mut().filter_map(taken).collect::<Vec<_>>())
        });
        let images = PyDict::new(py);
        for (name, image) in &self.known {
            images.set_item(name, image)?;
        }
        for (name, image) in raised(py, found)? {
            images.set_item(name, array(py, image)?)?;
        }
        Ok(images)
    }
}
