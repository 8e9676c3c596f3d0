//! A graph beside other programs: their time for an image that errs no less, on the same machine.

use super::list::{Moves, Ours, Renderer, Run};
use super::pairs::{Timed, least};
use super::{Bench, Row, Wanted};
use crate::bench::peers::{self, Job};
use crate::bench::references::{Manifest, References};
use crate::bench::results::{Absent, Entry, Phase};
use crate::bench::score::{Score, score};
use crate::diag::{Checked, Diagnostic};
use std::collections::BTreeMap;

/// What renderers made at the references' size, by folder, name and scene: each is asked once.
type Made = BTreeMap<(String, String, String), Result<Vec<Entry>, Absent>>;

/// The rows of each entry of a list, in turn.
pub(super) fn rows<'a>(bench: &'a Bench<'_>, list: &'a [Renderer]) -> impl Iterator<Item = Checked<Vec<Row>>> + 'a {
    let mut made = Made::new();
    list.iter().map(move |renderer| beside(bench, renderer, &mut made))
}

const SECTION: &str = "against other renderers";

fn beside(bench: &Bench<'_>, renderer: &Renderer, made: &mut Made) -> Checked<Vec<Row>> {
    let Renderer { name, run, output, image, .. } = renderer;
    let manifest = Manifest::read(bench.references)?;
    let mut small = bench.session(run, &run.graph, Moves::All)?;
    let scene = small.session.scene.name.clone();
    let camera = manifest.views().into_iter().find(|(s, _)| *s == scene).and_then(|(_, camera)| camera);
    small.session.settings.camera.clone_from(&camera);
    small.frame(bench.gpu)?;
    let size = small.session.settings.size;
    let references = manifest.load(&scene, camera.as_deref(), size, &mut vec![])?;
    let images = BTreeMap::from([(output.clone(), small.session.image(bench.gpu, output)?)]);
    let error = rmse(&score(&images, &references, &BTreeMap::new())?, output).ok_or_else(|| {
        Diagnostic::error(format!("`{name}`: there is no reference of `{output}` of {scene} at {size:?}"))
    })?;

    let (folder, peer) = &renderer.peer;
    let Some(peer) = peers::find(&bench.root.join(folder))?.into_iter().find(|p| p.name == *peer) else {
        return Err(Diagnostic::error(format!("`{name}`: no file of {folder} describes `{peer}`")).into());
    };
    let out = std::env::temp_dir().join(format!("lightgraph-{}-{}", peer.name, std::process::id()));
    let scene_file = bench.root.join(&run.scene);
    let ask = |size: [u32; 2], references: &References, setting: Option<usize>| {
        let camera = camera.as_deref();
        let job = Job { scene_file: &scene_file, scene: &scene, camera, size, references, folder: &out, setting };
        let result = peers::run(&peer, job);
        // Images for a moment: what can't be removed there is the system's to remove.
        let _ = std::fs::remove_dir_all(&out);
        result.map(|rendered| rendered.into_iter().map(|(entry, _)| entry).collect::<Vec<_>>())
    };
    let absent = |absent: &Absent| {
        let row = Row::new(SECTION, name, f64::NAN, "× faster");
        Ok(vec![row.note(format!("not run: {} is absent: {}", absent.name, absent.why))])
    };
    let key = (folder.clone(), peer.name.clone(), run.scene.clone());
    let theirs = match made.entry(key).or_insert_with(|| ask(size, &references, None)) {
        Ok(theirs) => theirs,
        Err(why) => return absent(why),
    };
    let row = |part: &str| Row::new(SECTION, format!("{name}, {part}"), f64::NAN, "× faster");
    let first = match renderer.ours {
        Ours::Files => "to the first image",
        Ours::Frame => "a frame of everything",
    };
    let Some(place) = pick(renderer, theirs, error) else {
        let note = format!("every setting of {} errs less than ours: {error:.1} %", peer.name);
        return Ok(vec![row(first).wanted(Wanted::AtLeast(renderer.at_least)).note(note)]);
    };
    let theirs = &theirs[place];
    let large = [image.0, image.1];
    let seconds = |entry: &Entry| entry.times(Phase::Whole).map_or(f64::NAN, |t| t.wall_ms.median / 1e3);
    let seconds = match size == large {
        true => seconds(theirs),
        // Compared with nothing, and timed with this setting alone.
        false => match ask(large, &References::default(), Some(place + 1)) {
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
    let judged = |part: &str, ours: f64, least: f64| {
        let row = Row { value: seconds * 1e3 / ours, ..row(part) };
        row.wanted(Wanted::AtLeast(least)).note(format!("{:.3} s here, {whose}", ours / 1e3))
    };
    let large = Run { size: *image, ..run.clone() };
    let times = |moves: Moves| -> Checked<f64> {
        let mut timed = bench.session(&large, &large.graph, moves)?;
        timed.session.settings.camera.clone_from(&camera);
        frames(bench, &mut timed)
    };
    let ours = match renderer.ours {
        Ours::Files => bench.from_files(&large)?.iter().sum(),
        Ours::Frame => times(Moves::All)?,
    };
    let mut rows = vec![judged(first, ours, renderer.at_least)];
    if let Some(least) = renderer.moved_at_least {
        rows.push(judged("after the camera moved", times(Moves::Camera)?, least));
    }
    Ok(rows)
}

/// The least time of a frame, in milliseconds, after a first one.
fn frames(bench: &Bench<'_>, timed: &mut Timed) -> Checked<f64> {
    timed.frame(bench.gpu)?;
    let times = (0..bench.repeat.max(1)).map(|_| timed.frame(bench.gpu)).collect::<Checked<Vec<f64>>>()?;
    Ok(least(&times))
}

/// The place of the setting that errs least of those that err no less than `error`.
fn pick(renderer: &Renderer, theirs: &[Entry], error: f64) -> Option<usize> {
    let asked = |e: &Entry| renderer.setting.iter().all(|(k, v)| e.params.get(k) == Some(v));
    let errors = theirs.iter().enumerate().filter(|(_, e)| asked(e));
    let errors = errors.filter_map(|(i, e)| Some((i, rmse(&e.scores, &renderer.output)?)));
    errors.filter(|(_, e)| *e >= error).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// Of an output, against the reference that applies always, in percent of the mean.
fn rmse(scores: &[Score], output: &str) -> Option<f64> {
    scores.iter().find(|s| s.output == output && s.only_when.is_empty()).map(|s| s.metrics.rmse_percent)
}
