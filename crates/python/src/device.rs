//! The adapters that renderers share: one device each for the whole process.

use crate::faults;
use lightgraph::internals::gpu::{OpenError, wanted_adapter};
use lightgraph::{Checked, Diagnostic, Faults, Gpu};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A device of the process that opened it.
#[derive(Debug, Clone)]
pub struct Device {
    pub gpu: Arc<Gpu>,
    process: u32,
}

/// By part of the adapter's name that was asked for.
static OPEN: Mutex<BTreeMap<Option<String>, Device>> = Mutex::new(BTreeMap::new());

impl Device {
    /// The device of an adapter with this part in its name, or of the best one.
    ///
    /// # Errors
    /// `NoAdapterError`, or `GraphError` where the adapter gives no device.
    pub fn open(py: Python<'_>, part: Option<String>) -> PyResult<Device> {
        let part = part.or_else(wanted_adapter);
        py.detach(|| opened(part)).map_err(|e| match e {
            OpenError::NoAdapter(d) => faults::exception(py, "NoAdapterError", &d.into()),
            OpenError::Other(f) => faults::exception(py, "GraphError", &f),
        })
    }

    /// # Errors
    /// This is another process than the one that opened it: drivers don't survive `fork`.
    pub fn check(&self) -> Checked<()> {
        if self.process == std::process::id() {
            return Ok(());
        }
        Err(forked().into())
    }
}

fn opened(part: Option<String>) -> Result<Device, OpenError> {
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(device) = open.get(&part) {
        device.check().map_err(OpenError::Other)?;
        // One that is lost makes room for another try.
        if device.gpu.check().is_ok() {
            return Ok(device.clone());
        }
    }
    let gpu = Arc::new(Gpu::open_named(part.as_deref())?);
    let device = Device { gpu, process: std::process::id() };
    open.insert(part, device.clone());
    Ok(device)
}

fn forked() -> Diagnostic {
    let d = Diagnostic::error("the device was opened before this process was forked, and can't be used in it");
    d.help("start processes by \"spawn\": `multiprocessing.set_start_method(\"spawn\")`")
}

/// Waits for the work that this process has submitted. Called when the interpreter exits: a driver that runs on the
/// CPU crashes where its threads still work while the libraries below them are torn down.
#[pyfunction]
pub fn drain(py: Python<'_>) {
    py.detach(|| {
        let open: Vec<Device> = OPEN.lock().unwrap_or_else(PoisonError::into_inner).values().cloned().collect();
        for device in open.iter().filter(|device| device.check().is_ok()) {
            // Nobody is left to tell of a device that fails or does not answer.
            let _ = device.gpu.wait();
        }
    });
}

/// The name of the adapter that renderers get, its driver, and whether a CPU does its work.
#[pyfunction]
#[pyo3(signature = (part=None))]
pub fn adapter(py: Python<'_>, part: Option<String>) -> PyResult<(String, String, bool)> {
    let device = Device::open(py, part)?;
    let info = &device.gpu.info;
    Ok((info.name.clone(), info.driver_info.clone(), device.gpu.is_software()))
}

/// As [`Device::check`], as an exception.
///
/// # Errors
/// `GraphError`.
pub fn usable(py: Python<'_>, device: &Device) -> PyResult<()> {
    let checked: Result<(), Faults> = device.check();
    faults::raised(py, checked)
}
