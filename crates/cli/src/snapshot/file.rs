//! The test file: RON to a [`Test`]. Gathers every fault.

use super::check::{Check, CheckKind, Limits, MirrorAxis};
use glam::Vec3;
use lightgraph::internals::builtin;
use lightgraph::internals::diag::{Source, Span};
use lightgraph::internals::graph::ast::Name;
use lightgraph::internals::graph::read::{Fields, Reader};
use lightgraph::internals::graph::tree::{SyntaxKind, SyntaxNode, parse};
use lightgraph::{Checked, Diagnostic, Faults};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// A test: what is rendered, what happens over the frames, what must hold in the end.
#[derive(Debug, Clone)]
pub struct Test {
    /// Where its file lies; references stand beside it.
    pub path: PathBuf,
    pub about: String,
    pub span: Span,
    pub start: Setup,
    pub steps: Vec<ScriptStep>,
    /// A test that takes longer hangs.
    pub time_limit: Duration,
    /// At least one.
    pub checks: Vec<Check>,
}

/// What is rendered.
#[derive(Debug, Clone)]
pub struct Setup {
    pub graph: File,
    /// `None`: a stand-in, of which the graph may use nothing.
    pub scene: Option<File>,
    pub camera: Option<Name>,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Parameters as written; the graph says their types.
    pub params: Vec<(Name, SyntaxNode)>,
    /// What all lights and emissive materials are multiplied by.
    pub light: f32,
    /// Frames check the numbers that every step leaves.
    pub watch: bool,
    /// What stands otherwise in the shaders than in their files, in order.
    pub edits: Vec<Edit>,
}

/// A change of a shader's text.
#[derive(Debug, Clone)]
pub struct Edit {
    /// Its path below the shader folder.
    pub shader: Name,
    /// What stands in the shader, once.
    pub from: Name,
    /// What comes instead.
    pub to: String,
}

/// A file that a test names, and where.
#[derive(Debug, Clone)]
pub struct File {
    pub path: PathBuf,
    pub span: Span,
}

/// A line of the script.
#[derive(Debug, Clone)]
pub enum ScriptStep {
    /// Renders `count` frames; the clock goes on by `step` seconds after each.
    Frames {
        count: u32,
        step: f32,
    },
    /// Metres, world space, on top of earlier moves.
    MoveCamera(Vec3),
    MoveLights(Vec3),
    MoveNode(Name, Vec3),
    Set(Vec<(Name, SyntaxNode)>),
    Swap(File),
    Resize([u32; 2]),
    /// From now on a shader's text is another; its file stays as it is.
    Edit(Edit),
    /// A shader's text is that of its file again.
    Restore(Name),
}

/// Another run of the same script: what it begins with instead.
#[derive(Debug, Clone)]
pub struct ScriptRun {
    pub graph: Option<File>,
    pub scene: Option<File>,
    pub camera: Option<Name>,
    pub params: Vec<(Name, SyntaxNode)>,
    pub light: Option<f32>,
}

impl ScriptRun {
    /// The setup with this run's parts in place of its own.
    pub fn of(&self, setup: &Setup) -> Setup {
        let mut setup = setup.clone();
        setup.graph = self.graph.clone().unwrap_or(setup.graph);
        setup.scene = self.scene.clone().or(setup.scene);
        setup.camera = self.camera.clone().or(setup.camera);
        setup.light = self.light.unwrap_or(setup.light);
        replace(&mut setup.params, &self.params);
        setup
    }
}

/// Puts settings in the place of those of the same names.
pub fn replace(params: &mut Vec<(Name, SyntaxNode)>, by: &[(Name, SyntaxNode)]) {
    params.retain(|(old, _)| !by.iter().any(|(new, _)| new.value == old.value));
    params.extend(by.iter().cloned());
}

/// Seconds after which a test hangs that does not say its own: ten times what the slowest should take on a software
/// driver.
const TIME_LIMIT: f64 = 300.0;

/// An image's edge beyond which a test is a benchmark.
const LARGEST: f64 = 4096.0;

/// Reads a test file.
///
/// # Errors
/// Every fault of the file, with its place.
pub fn load(path: &Path) -> Checked<Test> {
    read(path, &Source::read(path)?)
}

/// As [`load`], of the text of a file at `path`.
///
/// # Errors
/// As [`load`].
pub fn read(path: &Path, source: &Arc<Source>) -> Checked<Test> {
    let node = parse(source)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut read = Parser { reader: Reader::default(), folder };
    let test = read.test(path, &node);
    match test {
        Some(test) => Faults::check(read.reader.faults, test),
        None => Err(Faults(read.reader.faults)),
    }
}

struct Parser<'a> {
    reader: Reader,
    /// What paths are relative to.
    folder: &'a Path,
}

impl Parser<'_> {
    fn test(&mut self, path: &Path, node: &SyntaxNode) -> Option<Test> {
        let (_, mut f) = self.reader.named(node, &["Test"])?;
        let about = self.reader.need(&mut f, "about").and_then(|n| self.reader.prose(n));
        let graph = self.reader.need(&mut f, "graph").and_then(|n| self.file(n));
        let scene = f.get("scene").and_then(|n| self.file(n));
        let camera = f.get("camera").and_then(|n| self.reader.text(n));
        let size = self.reader.need(&mut f, "size").and_then(|n| self.size(n));
        let params = self.params(f.get("params"));
        let light = self.positive(&mut f, "light").unwrap_or(1.0);
        let time_limit = f.get("time_limit").map_or(Some(TIME_LIMIT), |n| self.whole(n, 1.0, 86_400.0));
        let steps = f.get("steps");
        let listed: Vec<ScriptStep> = self.reader.list(steps).iter().filter_map(|n| self.step(n)).collect();
        let checks = self.reader.need(&mut f, "checks");
        let places = self.reader.list(checks);
        let checks: Vec<Check> = places.iter().filter_map(|n| self.check(n)).collect();
        self.restored(&listed);
        self.reader.finish(&f);
        if places.is_empty() {
            self.reader.fault(Diagnostic::error("a test without checks would always pass").at(&node.span, ""));
        }
        if let (Some(n), Some(last)) = (steps, listed.last())
            && !matches!(last, ScriptStep::Frames { .. })
        {
            let d = Diagnostic::error("nothing is rendered after the last step").at(&n.span, "");
            self.reader.fault(d.help("end with `Frames()`"));
        }
        let once = || vec![ScriptStep::Frames { count: 1, step: 0.0 }];
        Some(Test {
            path: path.to_path_buf(),
            about: about?,
            span: node.span.clone(),
            start: Setup {
                graph: graph?,
                scene,
                camera,
                size: size?,
                params,
                light: light as f32,
                watch: false,
                edits: vec![],
            },
            steps: if listed.is_empty() { once() } else { listed },
            time_limit: Duration::from_secs_f64(time_limit?),
            checks,
        })
    }

    fn step(&mut self, node: &SyntaxNode) -> Option<ScriptStep> {
        let (kind, mut f) = self.reader.named(node, &["Frames", "Move", "Set", "Swap", "Resize", "Edit", "Restore"])?;
        let step = match kind {
            "Frames" => {
                let count = f.get("count").map_or(Some(1.0), |n| self.whole(n, 1.0, 10_000.0));
                let step = f.get("step").map_or(Some(0.0), |n| self.reader.number(n));
                count.zip(step).map(|(count, step)| ScriptStep::Frames { count: count as u32, step: step as f32 })
            }
            "Move" => self.moved(&mut f, node),
            "Set" => self.reader.need(&mut f, "params").map(|n| ScriptStep::Set(self.params(Some(n)))),
            "Swap" => self.reader.need(&mut f, "graph").and_then(|n| self.file(n)).map(ScriptStep::Swap),
            "Resize" => self.reader.need(&mut f, "size").and_then(|n| self.size(n)).map(ScriptStep::Resize),
            "Edit" => {
                let [shader, from, to] = ["shader", "from", "to"].map(|name| self.needed_text(&mut f, name));
                shader
                    .zip(from)
                    .zip(to)
                    .map(|((shader, from), to)| ScriptStep::Edit(Edit { shader, from, to: to.value }))
            }
            _ => self.needed_text(&mut f, "shader").map(ScriptStep::Restore),
        };
        self.reader.finish(&f);
        step
    }

    fn needed_text(&mut self, f: &mut Fields, name: &'static str) -> Option<Name> {
        self.reader.need(f, name).and_then(|n| self.reader.text(n))
    }

    /// What is restored must have been edited.
    fn restored(&mut self, steps: &[ScriptStep]) {
        let mut edited: Vec<&str> = vec![];
        for step in steps {
            match step {
                ScriptStep::Edit(edit) => edited.push(&edit.shader.value),
                ScriptStep::Restore(shader) => {
                    if !edited.contains(&shader.value.as_str()) {
                        let d = Diagnostic::error(format!("`{}` is not edited before", shader.value));
                        self.reader.fault(d.at(&shader.span, "").nearest(&shader.value, edited.iter().copied()));
                    }
                    edited.retain(|name| *name != shader.value);
                }
                _ => {}
            }
        }
    }

    /// `Move(camera: (x, y, z))`, `Move(lights: …)` or `Move(node: "name", by: …)`.
    fn moved(&mut self, f: &mut Fields, node: &SyntaxNode) -> Option<ScriptStep> {
        let (camera, lights, name) = (f.get("camera"), f.get("lights"), f.get("node"));
        match (camera, lights, name) {
            (Some(n), None, None) => self.vector(n).map(ScriptStep::MoveCamera),
            (None, Some(n), None) => self.vector(n).map(ScriptStep::MoveLights),
            (None, None, Some(n)) => {
                let by = self.reader.need(f, "by").and_then(|n| self.vector(n));
                self.reader.text(n).zip(by).map(|(name, by)| ScriptStep::MoveNode(name, by))
            }
            _ => {
                let d = Diagnostic::error("`Move` moves one of `camera`, `lights` and `node`").at(&node.span, "");
                self.reader.fault(d);
                None
            }
        }
    }

    fn check(&mut self, node: &SyntaxNode) -> Option<Check> {
        const KINDS: [&str; 11] = [
            "Plan",
            "Bytes",
            "Image",
            "Steps",
            "Iterations",
            "Mean",
            "Constant",
            "Symmetric",
            "NotBrighter",
            "Times",
            "Incremental",
        ];
        let (name, mut f) = self.reader.named(node, &KINDS)?;
        // A number that decides needs a reason; what is exact needs none.
        let exact = matches!(name, "Plan" | "Steps" | "Incremental");
        let reason = match exact {
            true => f.get("reason").map_or(Some(String::new()), |n| self.reader.prose(n)),
            false => self.reader.need(&mut f, "reason").and_then(|n| self.reader.prose(n)),
        };
        let kind = self.check_kind(name, &mut f);
        self.reader.finish(&f);
        Some(Check { span: node.span.clone(), reason: reason?, kind: kind? })
    }

    fn check_kind(&mut self, name: &str, f: &mut Fields) -> Option<CheckKind> {
        Some(match name {
            "Plan" => CheckKind::Plan,
            "Incremental" => CheckKind::Incremental,
            "Bytes" => {
                let n = self.reader.need(f, "at_most")?;
                CheckKind::Bytes { at_most: self.whole(n, 0.0, 1e15)? as u64 }
            }
            "Image" => {
                let per_adapter = self.reader.bool(f.get("per_adapter"), false);
                let (output, limits) = (self.output(f), self.limits(f));
                CheckKind::Image { output: output?, limits: limits?, per_adapter }
            }
            "Steps" => CheckKind::Steps { ran: self.texts(f.get("ran")), skipped: self.texts(f.get("skipped")) },
            "Iterations" => {
                let name = self.reader.need(f, "of").and_then(|n| self.reader.text(n));
                let least = self.reader.need(f, "min").and_then(|n| self.whole(n, 0.0, 1e9));
                let most = self.reader.need(f, "max").and_then(|n| self.whole(n, 0.0, 1e9));
                CheckKind::Iterations { name: name?, min: least? as u32, max: most? as u32 }
            }
            "Mean" => {
                let (output, tolerance) = (self.output(f), self.tolerance(f, "tolerance"));
                let value = self.reader.need(f, "value").and_then(|n| self.reader.number(n));
                CheckKind::Mean { output: output?, value: value?, tolerance: tolerance? }
            }
            "Constant" => {
                let (output, tolerance) = (self.output(f), self.tolerance(f, "tolerance"));
                let value = self.reader.need(f, "value").and_then(|n| self.rgb(n));
                CheckKind::Constant { output: output?, value: value?, tolerance: tolerance? }
            }
            "Symmetric" => {
                let (output, limits) = (self.output(f), self.limits(f));
                let axes = [("LeftRight", MirrorAxis::LeftRight), ("TopBottom", MirrorAxis::TopBottom)];
                let axis = self.reader.need(f, "axis");
                let axis = self.reader.word(axis, &axes, MirrorAxis::LeftRight);
                CheckKind::Symmetric { output: output?, axis, limits: limits? }
            }
            "NotBrighter" => {
                let (output, slack) = (self.output(f), self.tolerance(f, "slack"));
                let than = self.reader.need(f, "than").and_then(|n| self.run(n));
                CheckKind::NotBrighter { output: output?, than: than?, slack: slack? }
            }
            _ => {
                let (output, limits) = (self.output(f), self.limits(f));
                let of = self.reader.need(f, "of").and_then(|n| self.run(n));
                let factor = self.reader.need(f, "factor").and_then(|n| self.reader.number(n));
                CheckKind::Times { output: output?, factor: factor?, of: of?, limits: limits? }
            }
        })
    }

    fn run(&mut self, node: &SyntaxNode) -> Option<ScriptRun> {
        let (_, mut f) = self.reader.named(node, &["Run"])?;
        let run = ScriptRun {
            graph: f.get("graph").and_then(|n| self.file(n)),
            scene: f.get("scene").and_then(|n| self.file(n)),
            camera: f.get("camera").and_then(|n| self.reader.text(n)),
            params: self.params(f.get("params")),
            light: self.positive(&mut f, "light").map(|x| x as f32),
        };
        self.reader.finish(&f);
        Some(run)
    }

    fn limits(&mut self, f: &mut Fields) -> Option<Limits> {
        let limits = Limits {
            rmse: self.positive(f, "rmse"),
            max: self.positive(f, "max"),
            p95: self.positive(f, "p95"),
            flip: self.positive(f, "flip"),
        };
        if limits == Limits::default() {
            self.reader.need(f, "rmse");
            return None;
        }
        Some(limits)
    }

    fn output(&mut self, f: &mut Fields) -> Option<Name> {
        let node = self.reader.need(f, "output")?;
        self.reader.name(node)
    }

    fn tolerance(&mut self, f: &mut Fields, name: &'static str) -> Option<f64> {
        self.reader.need(f, name)?;
        self.positive(f, name)
    }

    /// An optional number of at least 0.
    fn positive(&mut self, f: &mut Fields, name: &'static str) -> Option<f64> {
        let node = f.get(name)?;
        let number = self.reader.number(node)?;
        if number < 0.0 {
            self.reader.fault(Diagnostic::error(format!("`{name}` can't be negative")).at(&node.span, ""));
            return None;
        }
        Some(number)
    }

    fn whole(&mut self, node: &SyntaxNode, min: f64, max: f64) -> Option<f64> {
        let number = self.reader.number(node)?;
        if number.fract() != 0.0 || number < min || number > max {
            let d = Diagnostic::error(format!("expected a whole number from {min} to {max}"));
            self.reader.fault(d.at(&node.span, ""));
            return None;
        }
        Some(number)
    }

    fn size(&mut self, node: &SyntaxNode) -> Option<[u32; 2]> {
        match self.reader.numbers(node)?[..] {
            [w, h] if [w, h].iter().all(|x| *x >= 1.0 && *x <= LARGEST && x.fract() == 0.0) => {
                Some([w as u32, h as u32])
            }
            _ => {
                let d = Diagnostic::error(format!("expected a size in pixels: (width, height), up to {LARGEST}"));
                self.reader.fault(d.at(&node.span, ""));
                None
            }
        }
    }

    fn vector(&mut self, node: &SyntaxNode) -> Option<Vec3> {
        self.three(node).map(|[x, y, z]| Vec3::new(x as f32, y as f32, z as f32))
    }

    /// Three numbers; one stands for all of them.
    fn rgb(&mut self, node: &SyntaxNode) -> Option<[f64; 3]> {
        match &node.kind {
            SyntaxKind::Word => self.reader.number(node).map(|x| [x; 3]),
            _ => self.three(node),
        }
    }

    fn three(&mut self, node: &SyntaxNode) -> Option<[f64; 3]> {
        match self.reader.numbers(node)?[..] {
            [x, y, z] => Some([x, y, z]),
            _ => {
                self.reader.fault(Diagnostic::error("expected three numbers: (x, y, z)").at(&node.span, ""));
                None
            }
        }
    }

    fn params(&mut self, node: Option<&SyntaxNode>) -> Vec<(Name, SyntaxNode)> {
        let pairs = self.reader.map(node);
        pairs.iter().filter_map(|(k, v)| Some((self.reader.name(k)?, v.clone()))).collect()
    }

    fn texts(&mut self, node: Option<&SyntaxNode>) -> Vec<Name> {
        self.reader.list(node).iter().filter_map(|n| self.reader.text(n)).collect()
    }

    fn file(&mut self, node: &SyntaxNode) -> Option<File> {
        let text = self.reader.text(node)?;
        Some(File { path: builtin::join(self.folder, &text.value), span: text.span })
    }
}
