//! Pictures of entries and references: files beside the results, and in the page.

use super::SceneView;
use crate::base64::base64;
use crate::bench::measure::SEEN;
use crate::bench::references::ReferenceSet;
use crate::bench::results::{Entry, Phase, Results};
use crate::bench::score::mean;
use lightgraph::internals::files;
use lightgraph::internals::image::difference::difference;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::{Checked, Image};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Mean light that pictures are exposed to show.
const MIDDLE: f64 = 0.25;

/// How every PNG file begins.
const PNG: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Writes a picture of an entry and, where there is a reference, one of the difference. Its path relative to the
/// folder.
///
/// # Errors
/// Files that can't be written.
pub fn pictures(
    folder: &Path,
    entry: &Entry,
    images: &BTreeMap<String, Image>,
    references: &ReferenceSet,
) -> Checked<Option<String>> {
    let Some(seen) = images.get(SEEN).or_else(|| images.values().next()) else { return Ok(None) };
    let stem = file_name(&[&view_name(&entry.scene, entry.camera.as_deref()), &entry.graph, &entry.setting]);
    let path = format!("images/{stem}.png");
    write_png(&folder.join(&path), seen, ToneMap::Neutral, exposure(seen, references), &BTreeMap::new())?;
    let compared = references.all.iter().find(|r| r.output == SEEN && r.only_when.is_empty() && mean(&r.image) > 0.0);
    if let (Some(reference), Some(image)) = (compared, images.get(SEEN)) {
        let shown = difference(image, &reference.image)?.image;
        let to = folder.join(difference_path(&path));
        write_png(&to, &shown, ToneMap::None, 0.0, &BTreeMap::new())?;
    }
    Ok(Some(path))
}

/// Writes the picture of a scene's reference.
///
/// # Errors
/// A file that can't be written.
pub fn reference_pictures(folder: &Path, scene: &str, camera: Option<&str>, references: &ReferenceSet) -> Checked<()> {
    match references.all.iter().find(|r| r.output == SEEN && r.only_when.is_empty()) {
        Some(r) => {
            let path = folder.join(reference_path(scene, camera));
            write_png(&path, &r.image, ToneMap::Neutral, exposure(&r.image, references), &BTreeMap::new())
        }
        None => Ok(()),
    }
}

/// Copies the pictures of an entry and of its scene's reference from one folder of results to another.
///
/// # Errors
/// A file that can't be written. What is not there, or no picture, is left out.
pub fn copy(entry: &Entry, from: &Path, to: &Path) -> Checked<()> {
    let own = entry.picture.iter().flat_map(|p| [p.clone(), difference_path(p)]);
    for path in own.chain([reference_path(&entry.scene, entry.camera.as_deref())]) {
        if let Some(bytes) = files::inside(from, &path).ok().and_then(|there| picture(&there)) {
            write_atomically(&to.join(path), &bytes)?;
        }
    }
    Ok(())
}

/// The reference, and each graph at its most accurate setting, as data URIs.
pub fn shown(results: &Results, view: &SceneView, entries: &[&Entry], folder: &Path, most: usize) -> Vec<Value> {
    let mut pictures = vec![];
    if most == 0 {
        return pictures;
    }
    if let Some(color) = data_uri(&folder.join(reference_path(&view.scene, view.camera.as_deref()))) {
        pictures.push(json!({"label": "reference", "color": color}));
    }
    let output = results.main_output.as_deref().unwrap_or(SEEN);
    let still = Phase::Still;
    let error = |e: &Entry| {
        let score = e.score(output, still).or(e.score(SEEN, still));
        score.map(|s| s.metrics.rmse_percent).or(e.leak).unwrap_or(f64::INFINITY)
    };
    let mut best: Vec<&Entry> = vec![];
    for e in entries.iter().filter(|e| e.picture.is_some()) {
        match best.iter_mut().find(|b| b.graph == e.graph) {
            Some(b) if error(e) < error(b) => *b = e,
            Some(_) => {}
            None => best.push(e),
        }
    }
    best.sort_by(|a, b| error(a).total_cmp(&error(b)));
    for e in best.into_iter().take(most) {
        let Some(path) = &e.picture else { continue };
        let named = |path: &str| data_uri(&files::inside(folder, path).ok()?);
        if let Some(color) = named(path) {
            let difference = named(&difference_path(path));
            let text = format!("{} {}", e.graph, e.setting);
            pictures.push(json!({"label": text.trim(), "color": color, "difference": difference}));
        }
    }
    pictures
}

fn exposure(image: &Image, references: &ReferenceSet) -> f32 {
    let reference = references.all.iter().find(|r| r.output == SEEN && r.only_when.is_empty());
    let level = mean(reference.map_or(image, |r| &r.image));
    if level > 0.0 { (MIDDLE / level).log2() as f32 } else { 0.0 }
}

fn view_name(scene: &str, camera: Option<&str>) -> String {
    camera.map_or(scene.to_string(), |c| format!("{scene}_{c}"))
}

fn reference_path(scene: &str, camera: Option<&str>) -> String {
    format!("images/{}.png", file_name(&[&view_name(scene, camera), "reference"]))
}

fn difference_path(picture: &str) -> String {
    picture.replace(".png", "_difference.png")
}

/// A name of letters, digits, `-` and `_` only.
fn file_name(parts: &[&str]) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    parts.iter().filter(|p| !p.is_empty()).map(|p| p.chars().map(plain).collect()).collect::<Vec<String>>().join("_")
}

fn data_uri(path: &Path) -> Option<String> {
    Some(format!("data:image/png;base64,{}", base64(&picture(path)?)))
}

/// The bytes of a picture. Results name any path, and the page may be given to others: nothing else is read.
fn picture(path: &Path) -> Option<Vec<u8>> {
    files::read(path, files::IMAGE).ok().filter(|bytes| bytes.starts_with(&PNG))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tempfile::TempDir;

    #[test]
    fn only_pictures_in_the_results_folder_are_shown() {
        let folder = TempDir::new().unwrap();
        let inner = folder.path().join("results");
        write_png(&inner.join("a.png"), &Image::filled(1, 1, &[1.0]).unwrap(), ToneMap::None, 0.0, &BTreeMap::new())
            .unwrap();
        std::fs::copy(inner.join("a.png"), folder.path().join("secret.png")).unwrap();
        std::fs::write(inner.join("words.png"), "root:x:0:0").unwrap();
        let shown = |named: &str| data_uri(&files::inside(&inner, named).ok()?);
        assert!(shown("a.png").is_some_and(|uri| uri.starts_with("data:image/png;base64,iVBORw0KGgo")));
        for named in ["words.png", "../secret.png", "/etc/passwd", "missing.png"] {
            assert_eq!(shown(named), None, "{named}");
        }
    }

    #[test]
    fn names_hold_nothing_that_a_file_system_minds() {
        assert_eq!(file_name(&["a/b", "", "grid=(4, 2)"]), "a_b_grid__4__2_");
    }
}
