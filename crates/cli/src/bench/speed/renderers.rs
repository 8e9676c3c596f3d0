//! A graph beside other programs: their time for an image that errs no less, on the same machine.

use super::list::{GraphRun, Moves, OtherRenderer, Ours};
use super::pairs::least;
use super::{Bench, Goal, SpeedRow};
use crate::bench::peers::{self, PeerJob};
use crate::bench::references::{Manifest, ReferenceSet};
use crate::bench::results::{Absent, Entry, Phase};
use crate::bench::score::{Score, score};
use lightgraph::{Checked, Diagnostic};
use std::collections::BTreeMap;

/// What renderers made at the references' size, by folder, name, scene and numbers of settings: each is asked once.
type RendererResults = BTreeMap<(String, String, String, Vec<usize>), Result<Vec<Entry>, Absent>>;

/// The rows of each entry of a list, in turn.
pub(super) fn rows<'a>(
    bench: &'a Bench<'_>,
    list: &'a [OtherRenderer],
) -> impl Iterator<Item = Checked<Vec<SpeedRow>>> + 'a {
    let mut made = RendererResults::new();
    list.iter().map(move |renderer| beside(bench, renderer, &mut made))
}

const SECTION: &str = "against other renderers";

fn beside(bench: &Bench<'_>, renderer: &OtherRenderer, made: &mut RendererResults) -> Checked<Vec<SpeedRow>> {
    let OtherRenderer { name, run, output, .. } = renderer;
    let (folder, peer) = &renderer.peer;
    let Some(peer) = peers::find(&bench.root.join(folder))?.into_iter().find(|p| p.name == *peer) else {
        return Err(Diagnostic::error(format!("`{name}`: no file of {folder} describes `{peer}`")).into());
    };
    let numbers = peer.numbers(&renderer.setting);
    if numbers.is_empty() {
        let d = Diagnostic::error(format!("`{name}`: {} has no setting with all of {:?}", peer.name, renderer.setting));
        return Err(d.help(format!("its settings stand in the file of {folder} that describes it")).into());
    }
    let view = RenderedView::of(bench, renderer)?;
    let out = std::env::temp_dir().join(format!("lightgraph-{}-{}", peer.name, std::process::id()));
    let scene_file = bench.root.join(&run.scene);
    let ask = |size: [u32; 2], references: &ReferenceSet, settings: &[usize]| {
        let (scene, camera) = (view.scene.as_str(), view.camera.as_deref());
        let job = PeerJob { scene_file: &scene_file, scene, camera, size, references, folder: &out, settings };
        let result = peers::run(&peer, job);
        // Images for a moment: what can't be removed there is the system's to remove.
        let _ = std::fs::remove_dir_all(&out);
        result.map(|rendered| rendered.into_iter().map(|(entry, _)| entry).collect::<Vec<_>>())
    };
    let absent = |absent: &Absent| {
        let row = SpeedRow::new(SECTION, name, f64::NAN, "× faster");
        Ok(vec![row.note(format!("not run: {} is absent: {}", absent.name, absent.why))])
    };

    let key = (folder.clone(), peer.name.clone(), run.scene.clone(), numbers.clone());
    let theirs = match made.entry(key).or_insert_with(|| ask(view.size, &view.references, &numbers)) {
        Ok(theirs) => theirs,
        Err(why) => return absent(why),
    };
    let error = view.error;
    let Some((place, theirs)) = pick(output, theirs, error) else {
        let note = format!("every setting of {} errs less than ours: {error:.1} %", peer.name);
        let row = SpeedRow::new(SECTION, format!("{name}, {}", renderer.ours.word()), f64::NAN, "× faster");
        return Ok(vec![row.wanted(Goal::AtLeast(renderer.at_least)).note(note)]);
    };
    let large = [renderer.image.0, renderer.image.1];
    let seconds = |entry: &Entry| entry.times(Phase::Whole).map_or(f64::NAN, |t| t.wall_ms.median / 1e3);
    let seconds = match view.size == large {
        true => seconds(theirs),
        // Compared with nothing, and with this setting alone.
        false => match ask(large, &ReferenceSet::default(), numbers.get(place..=place).unwrap_or_default()) {
            Ok(timed) => timed.first().map_or(f64::NAN, seconds),
            Err(why) => return absent(&why),
        },
    };
    let whose = format!(
        "{seconds:.2} s by {} {} ({}), rmse {:.1} %; ours {error:.1} %",
        theirs.graph,
        theirs.peer.as_deref().unwrap_or(""),
        theirs.setting,
        rmse(&theirs.scores, output).unwrap_or(f64::NAN),
    );
    let row = |part: &str, ours: f64, least: f64| {
        let row = SpeedRow::new(SECTION, format!("{name}, {part}"), seconds * 1e3 / ours, "× faster");
        row.wanted(Goal::AtLeast(least)).note(format!("{:.3} s here, {whose}", ours / 1e3))
    };
    let run = GraphRun { size: renderer.image, ..run.clone() };
    let first = match renderer.ours {
        Ours::Files => bench.first_image(&run)?.iter().sum(),
        Ours::Frame => view.frame(bench, &run, Moves::All)?,
    };
    let mut rows = vec![row(renderer.ours.word(), first, renderer.at_least)];
    if let Some(least) = renderer.moved_at_least {
        rows.push(row("after the camera moved", view.frame(bench, &run, Moves::Camera)?, least));
    }
    Ok(rows)
}

impl Ours {
    fn word(self) -> &'static str {
        match self {
            Ours::Files => "to the first image",
            Ours::Frame => "a frame of everything",
        }
    }
}

/// What our image shows, and how far it is off.
struct RenderedView {
    scene: String,
    /// The camera that the references are seen by; `None`: the scene's own.
    camera: Option<String>,
    size: [u32; 2],
    references: ReferenceSet,
    /// Rmse of the output, in percent of the mean.
    error: f64,
}

impl RenderedView {
    fn of(bench: &Bench<'_>, renderer: &OtherRenderer) -> Checked<RenderedView> {
        let OtherRenderer { name, run, output, .. } = renderer;
        let manifest = Manifest::read(bench.references)?;
        let mut timed = bench.session(run, &run.graph, Moves::All)?;
        let scene = timed.session.scene.name.clone();
        let camera = manifest.views().into_iter().find(|(s, _)| *s == scene).and_then(|(_, camera)| camera);
        timed.session.settings.camera.clone_from(&camera);
        timed.frame(bench.gpu)?;
        let size = timed.session.settings.size;
        let references = manifest.load(&scene, camera.as_deref(), size, &mut vec![])?;
        let images = BTreeMap::from([(output.clone(), timed.session.image(bench.gpu, output)?)]);
        let error = rmse(&score(&images, &references, &BTreeMap::new())?, output).ok_or_else(|| {
            Diagnostic::error(format!("`{name}`: there is no reference of `{output}` of {scene} at {size:?}"))
        })?;
        Ok(RenderedView { scene, camera, size, references, error })
    }

    /// The least time of a frame, in milliseconds, after a first one.
    fn frame(&self, bench: &Bench<'_>, run: &GraphRun, moves: Moves) -> Checked<f64> {
        let mut timed = bench.session(run, &run.graph, moves)?;
        timed.session.settings.camera.clone_from(&self.camera);
        timed.frame(bench.gpu)?;
        let times = (0..bench.repeat.max(1)).map(|_| timed.frame(bench.gpu)).collect::<Checked<Vec<f64>>>()?;
        Ok(least(&times))
    }
}

/// The setting that errs least of those that err no less than `error`, and its place.
fn pick<'a>(output: &str, theirs: &'a [Entry], error: f64) -> Option<(usize, &'a Entry)> {
    let errors = theirs.iter().enumerate().filter_map(|(i, e)| Some((i, e, rmse(&e.scores, output)?)));
    errors.filter(|(_, _, e)| *e >= error).min_by(|a, b| a.2.total_cmp(&b.2)).map(|(i, entry, _)| (i, entry))
}

/// Of an output, against the reference that applies always, in percent of the mean.
fn rmse(scores: &[Score], output: &str) -> Option<f64> {
    scores.iter().find(|s| s.output == output && s.only_when.is_empty()).map(|s| s.metrics.rmse_percent)
}
