//! Frames on the adapter of this machine. Without one these tests fail and say what to install.

use crate::support::repository;
use lightgraph::internals::diag::render as show;
use lightgraph::{Faults, Gpu, Image, Project, Scene, Session, Settings};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// The device, for one test at a time: a software adapter uses every core by itself.
pub fn gpu() -> MutexGuard<'static, Gpu> {
    static GPU: OnceLock<Mutex<Gpu>> = OnceLock::new();
    let open = || {
        let gpu = Gpu::open().unwrap_or_else(|e| {
            panic!("these tests render, and find no adapter to render on:\n{}", Faults::from(e));
        });
        Mutex::new(gpu)
    };
    // A test that failed while it held the device leaves it in order.
    GPU.get_or_init(open).lock().unwrap_or_else(PoisonError::into_inner)
}

/// What to render: a graph and a scene of the repository, and how.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    pub graph: &'a str,
    pub scene: &'a str,
    pub camera: Option<&'a str>,
    pub size: [u32; 2],
    /// As on the command line: `NAME=VALUE`, apart by spaces.
    pub set: &'a str,
}

impl<'a> Shot<'a> {
    /// With the scene's own camera and the graph's defaults.
    pub fn new(graph: &'a str, scene: &'a str, size: u32) -> Shot<'a> {
        Shot { graph, scene, camera: None, size: [size, size], set: "" }
    }

    /// One frame; the images of these outputs, in this order.
    pub fn render<const N: usize>(&self, outputs: [&str; N]) -> [Image; N] {
        self.render_frames(1, outputs)
    }

    /// Frames at 60 a second; the last one's images.
    pub fn render_frames<const N: usize>(&self, frames: u32, outputs: [&str; N]) -> [Image; N] {
        let gpu = gpu();
        let mut session =
            self.session(&gpu, &outputs).unwrap_or_else(|f| panic!("{} of {}\n{f}", self.graph, self.scene));
        for frame in 0..frames {
            let report = session.frame(&gpu, frame, frame as f32 / 60.0).unwrap_or_else(|f| panic!("{f}"));
            assert!(report.warnings.is_empty(), "{}", show(&report.warnings));
        }
        outputs.map(|name| {
            let image = session.image(&gpu, name).unwrap_or_else(|f| panic!("{f}"));
            if let Some(bad) = image.non_finite(None) {
                panic!("`{name}` of {} holds what is no number: {bad:?}", self.graph);
            }
            image
        })
    }

    fn session(&self, gpu: &Gpu, outputs: &[&str]) -> Result<Session, Faults> {
        let project = Project::open(&repository(self.graph), &[])?;
        let set: Vec<String> = self.set.split_whitespace().map(String::from).collect();
        let settings = Settings {
            params: project.params(&set)?,
            size: self.size,
            camera: self.camera.map(String::from),
            outputs: Some(outputs.iter().map(ToString::to_string).collect()),
            ..Settings::default()
        };
        Session::new(gpu, &project, Scene::load(&repository(self.scene))?.scene, settings)
    }
}
