//! Renders a graph once, and says what it took and how far it is from the reference.

use crate::list::{GalleryTable, TableRow};
use lightgraph::internals::image::metrics::compare;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Project, Scene, Session, Settings};
use lightgraph_cli::bench::references::{Manifest, ReferenceSet};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// What stays from one run to the next. What two tables share is run once.
pub struct GalleryBench<'a> {
    gpu: &'a Gpu,
    size: u32,
    manifest: Manifest,
    scenes: BTreeMap<String, Arc<Scene>>,
    runs: BTreeMap<String, MeasuredFrame>,
}

/// What pictures and figures are made of.
const OUTPUTS: [&str; 2] = ["color", "indirect"];

/// The images by output, and the seconds that the frame took.
type MeasuredFrame = (BTreeMap<String, Image>, f64);

impl GalleryBench<'_> {
    pub fn new(gpu: &Gpu, size: u32) -> Checked<GalleryBench<'_>> {
        let manifest = Manifest::read(Path::new("tests/references"))?;
        Ok(GalleryBench { gpu, size, manifest, scenes: BTreeMap::new(), runs: BTreeMap::new() })
    }

    /// Error and time of a row on a scene, as text.
    pub fn cell(&mut self, table: &GalleryTable, row: &TableRow, scene: &str) -> Checked<String> {
        let size = [self.size; 2];
        let set = |more: &str| format!("{} {more}", table.set);
        let (image, seconds) = self.rendered(&row.graph, scene, &set(&row.set), &table.output, size)?;
        let (expected, seen) = self.reference(scene, &table.output)?;
        let metrics = compare(&image, &expected, seen.as_deref())?;
        let (error, bias) = (metrics.rmse_percent, metrics.bias_percent);
        Ok(format!("{error:.1} % ({bias:+.0}), {}", time(seconds)))
    }

    /// What the times are.
    pub fn conditions(&self) -> String {
        let info = &self.gpu.info;
        let what = if self.gpu.is_software() { "processor time" } else { "time" };
        let edge = self.size;
        format!("Error (bias), {what} of one frame; {edge} × {edge} pixels, {}, {}", info.name, info.driver_info)
    }

    /// The reference that an output is compared with whatever the parameters, and the pixels that have one.
    fn reference(&self, scene: &str, output: &str) -> Checked<(Image, Option<Vec<bool>>)> {
        let name = scene.split(['.', ':']).next().unwrap_or(scene);
        let views = self.manifest.views();
        let named = scene.split_once(':').map(|(_, camera)| camera.to_string());
        let camera = named.or_else(|| views.into_iter().find(|(s, _)| s == name).and_then(|(_, camera)| camera));
        let ReferenceSet { all, answered, .. } =
            self.manifest.load(name, camera.as_deref(), [self.size; 2], &mut vec![])?;
        let found = all.into_iter().find(|r| r.output == output && r.only_when.is_empty());
        let missing = || Diagnostic::error(format!("{scene} has no reference for `{output}`"));
        Ok((found.ok_or_else(missing)?.image, answered))
    }

    /// An output of a graph's first frame, and the seconds that the frame took. A scene with `:CAMERA` is seen by that.
    pub fn rendered(
        &mut self,
        graph: &str,
        scene: &str,
        set: &str,
        output: &str,
        size: [u32; 2],
    ) -> Checked<(Image, f64)> {
        let set = set.split_whitespace().collect::<Vec<_>>().join(" ");
        let key = format!("{graph} {scene} {set} {size:?}");
        if !self.runs.contains_key(&key) {
            let run = self.run(graph, scene, &set, size)?;
            self.runs.insert(key.clone(), run);
        }
        let found = self.runs.get(&key).and_then(|(images, seconds)| Some((images.get(output)?.clone(), *seconds)));
        found
            .ok_or_else(|| Diagnostic::error(format!("{graph} has no output `{output}` that the gallery shows")).into())
    }

    fn run(&mut self, graph: &str, scene: &str, set: &str, size: [u32; 2]) -> Checked<MeasuredFrame> {
        let project = Project::open(&Path::new("graphs/gi").join(format!("{graph}.ron")), &[])?;
        let known = |text: &&str| {
            let name = text.split('=').next().unwrap_or(text);
            project.graph.params.iter().any(|(n, _)| n.value == name)
        };
        let set: Vec<String> = set.split_whitespace().filter(known).map(String::from).collect();
        let (file, camera) = scene.split_once(':').map_or((scene, None), |(f, c)| (f, Some(c.to_string())));
        let declared = project.graph.outputs.iter().map(|o| o.0.value.clone());
        let outputs: Vec<String> = declared.filter(|o| OUTPUTS.contains(&o.as_str())).collect();
        let settings = Settings {
            params: project.params(&set)?,
            size,
            camera,
            outputs: Some(outputs.clone()),
            skip: true,
            ..Settings::default()
        };
        let mut session = Session::new(self.gpu, &project, self.scene(file)?, settings)?;
        let start = Clock::start(self.gpu.is_software());
        session.frame(self.gpu, 0, 0.0)?;
        let seconds = start.seconds();
        let images = outputs.into_iter().map(|o| Ok((o.clone(), session.image(self.gpu, &o)?)));
        Ok((images.collect::<Checked<_>>()?, seconds))
    }

    fn scene(&mut self, file: &str) -> Checked<Arc<Scene>> {
        if let Some(found) = self.scenes.get(file) {
            return Ok(found.clone());
        }
        let loaded = Arc::new(Scene::load(&Path::new("scenes").join(file))?.scene);
        self.scenes.insert(file.to_string(), loaded.clone());
        Ok(loaded)
    }
}

fn time(seconds: f64) -> String {
    if seconds < 10.0 { format!("{seconds:.1} s") } else { format!("{seconds:.0} s") }
}

/// Of a software adapter the processor's time, which other programs on the machine change little; of others, time that
/// passes.
struct Clock {
    wall: Instant,
    /// Seconds at the start, where the system tells them.
    processor: Option<f64>,
}

impl Clock {
    fn start(software: bool) -> Clock {
        Clock { wall: Instant::now(), processor: processor_seconds().filter(|_| software) }
    }

    fn seconds(&self) -> f64 {
        let spent = self.processor.and_then(|start| Some(processor_seconds()? - start));
        spent.unwrap_or_else(|| self.wall.elapsed().as_secs_f64())
    }
}

/// What this process has taken so far, in all threads: fields 14 and 15 of Linux's `stat`, in hundredths of a second.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in brackets, may hold spaces.
    let (_, rest) = text.rsplit_once(')')?;
    let fields: Vec<&str> = rest.split_whitespace().collect();
    let ticks: f64 = fields.get(11..13)?.iter().filter_map(|f| f.parse::<f64>().ok()).sum();
    Some(ticks / 100.0)
}
