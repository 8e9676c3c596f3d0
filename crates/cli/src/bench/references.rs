//! What the outputs of a scene are compared with: images and closed forms, listed in two JSON files.
//!
//! `references.json` says what there is. An entry a scene and camera:
//!
//! ```json
//! [{"scene": "cornell_point", "camera": "cam", "renderer": "Mitsuba", "version": "3.9.1",
//!   "stderr_percent": {"indirect": 1.1}, "files": {"indirect": "cornell_point_indirect.exr", "normal": "…"},
//!   "errors": {"indirect": "cornell_point_indirect_error.exr"}},
//!  {"scene": "furnace", "camera": "inside", "exact": {"indirect": 1.0}}]
//! ```
//!
//! `comparison.json` beside it says which output a quantity is compared with, and what else a bench looks at:
//!
//! ```json
//! {"outputs": {"full": "color", "b1_indirect": "indirect[bounces=1]"}, "main": "indirect",
//!  "surface": "normal", "distance": "depth",
//!  "leaks": [{"scene": "two_rooms", "lit": "lit", "dark": "dark"}],
//!  "published": [{"scene": "art_gallery", "phase": "everything", "ms": 110, "source": "…"}]}
//! ```
//!
//! A quantity that isn't named there is the output of its name. In brackets stand parameters that a setting must have.
//! A pixel has no reference where `distance` tells of a surface that `surface` knows no normal of: there the other
//! renderer shows black. `exact` holds in every pixel. What `dark` sees relative to `lit` is light that went through a
//! wall.

use super::results::Phase;
use lightgraph::internals::files;
use lightgraph::internals::image::exr::read_exr;
use lightgraph::{Checked, Diagnostic, Faults, Image};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// All that is known to compare with.
#[derive(Debug, Clone, Default)]
pub struct Manifest {
    /// Where the files of the entries are.
    pub folder: PathBuf,
    pub entries: Vec<Listed>,
    pub comparison: EntryUse,
}

/// What one scene is compared with, seen by one camera.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Listed {
    pub scene: String,
    /// `None`: the scene's own.
    #[serde(default)]
    pub camera: Option<String>,
    #[serde(default)]
    pub renderer: Option<String>,
    #[serde(default)]
    pub version: Option<String>,
    /// Standard errors in percent of the mean, by quantity.
    #[serde(default)]
    pub stderr_percent: BTreeMap<String, f64>,
    /// Images by quantity.
    #[serde(default)]
    pub files: BTreeMap<String, String>,
    /// Images of standard errors by quantity: a pixel for each block of the quantity's image, of the mean over it.
    #[serde(default)]
    pub errors: BTreeMap<String, String>,
    /// Radiance that holds in every pixel, by quantity.
    #[serde(default)]
    pub exact: BTreeMap<String, f64>,
}

/// How the entries are used.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EntryUse {
    /// Quantity to output, with conditions in brackets.
    #[serde(default)]
    pub outputs: BTreeMap<String, String>,
    /// The quantities that tell normal and distance of the surface that is seen, 0 where there is none.
    #[serde(default)]
    pub surface: Option<String>,
    #[serde(default)]
    pub distance: Option<String>,
    /// The output whose errors a report shows first.
    #[serde(default)]
    pub main: Option<String>,
    #[serde(default)]
    pub leaks: Vec<Leak>,
    #[serde(default)]
    pub published: Vec<PublishedTime>,
}

/// Two cameras: what one sees should be nothing, relative to the other.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Leak {
    pub scene: String,
    pub lit: String,
    pub dark: String,
}

/// A time that others have published for a scene of the same size, to set ours beside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PublishedTime {
    pub scene: String,
    pub phase: Phase,
    /// The heading of passes it is of; `None`: the whole frame.
    #[serde(default)]
    pub group: Option<String>,
    pub ms: f64,
    pub source: String,
}

/// A reference in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedReference {
    pub output: String,
    /// Parameters that a setting must have for it to apply; empty: always.
    pub only_when: Vec<(String, String)>,
    pub image: Image,
    /// Whose it is, as "Mitsuba 3.9.1".
    pub origin: String,
    /// Standard error in percent of the mean, where it is known.
    pub stderr_percent: Option<f64>,
}

/// All references of one scene and camera for one size.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReferenceSet {
    pub all: Vec<LoadedReference>,
    /// Which pixels have a reference; `None`: all.
    pub answered: Option<Vec<bool>>,
    pub leak: Option<Leak>,
}

impl Manifest {
    /// Reads both files of a folder; one that isn't there is an empty one.
    ///
    /// # Errors
    /// Files that can't be read or hold something else.
    pub fn read(folder: &Path) -> Checked<Manifest> {
        let entries = read_json(&folder.join("references.json"))?.unwrap_or_default();
        let comparison = read_json(&folder.join("comparison.json"))?.unwrap_or_default();
        Ok(Manifest { folder: folder.to_path_buf(), entries, comparison })
    }

    /// The scenes and cameras worth rendering, in their order; cameras that look for leaks alone are not among them.
    pub fn views(&self) -> Vec<(String, Option<String>)> {
        let dark =
            |e: &Listed| self.comparison.leaks.iter().any(|l| l.scene == e.scene && e.camera.as_ref() == Some(&l.dark));
        let mut views: Vec<(String, Option<String>)> = vec![];
        for e in self.entries.iter().filter(|e| !dark(e)) {
            let view = (e.scene.clone(), e.camera.clone());
            if !views.contains(&view) {
                views.push(view);
            }
        }
        views
    }

    /// Loads what a scene seen by a camera is compared with. Images of another size are left out with a notice.
    ///
    /// # Errors
    /// Every file that can't be read and every name that makes no sense.
    pub fn load(
        &self,
        scene: &str,
        camera: Option<&str>,
        size: [u32; 2],
        notices: &mut Vec<Diagnostic>,
    ) -> Checked<ReferenceSet> {
        let leak = self.comparison.leaks.iter().find(|l| l.scene == scene).cloned();
        let mut found = ReferenceSet { leak, ..ReferenceSet::default() };
        let mut faults = vec![];
        let (mut normals, mut distances) = (None, None);
        for listed in self.entries.iter().filter(|e| e.scene == scene && e.camera.as_deref() == camera) {
            let origin = [listed.renderer.as_deref(), listed.version.as_deref()];
            let origin = origin.iter().flatten().copied().collect::<Vec<_>>().join(" ");
            for (key, file) in &listed.files {
                let path = self.folder.join(file);
                let image = match read_exr(&path) {
                    Ok(image) => image,
                    Err(Faults(more)) => {
                        faults.extend(more);
                        continue;
                    }
                };
                if [image.width, image.height] != size {
                    let [w, h] = size;
                    let text = format!("{} is {} × {}, not {w} × {h}", path.display(), image.width, image.height);
                    notices.push(Diagnostic::note(text + ": nothing is compared with it"));
                } else if self.comparison.surface.as_ref() == Some(key) {
                    normals = Some(image);
                } else if self.comparison.distance.as_ref() == Some(key) {
                    distances = Some(image);
                } else {
                    let stderr_percent = listed.stderr_percent.get(key).copied();
                    self.add(&mut found, key, image, &origin, stderr_percent, &mut faults);
                }
            }
            for (key, radiance) in &listed.exact {
                let image = Image::filled(size[0], size[1], &[*radiance as f32; 3])?;
                self.add(&mut found, key, image, "closed form", Some(0.0), &mut faults);
            }
        }
        if let (Some(normals), Some(distances)) = (normals, distances) {
            let answers = |(normal, distance): ([f32; 3], [f32; 3])| normal != [0.0; 3] || distance[0] == 0.0;
            found.answered = Some(normals.rgb().zip(distances.rgb()).map(answers).collect());
        }
        Faults::check(faults, found)
    }

    fn add(
        &self,
        found: &mut ReferenceSet,
        key: &str,
        image: Image,
        origin: &str,
        stderr_percent: Option<f64>,
        faults: &mut Vec<Diagnostic>,
    ) {
        let text = self.comparison.outputs.get(key).map_or(key, String::as_str);
        match output(text) {
            Some((output, only_when)) => {
                found.all.push(LoadedReference {
                    output,
                    only_when,
                    image,
                    origin: origin.to_string(),
                    stderr_percent,
                });
            }
            None => {
                let path = self.folder.join("comparison.json");
                let d = Diagnostic::error(format!("{}: `{text}` names no output", path.display()));
                faults.push(d.help("write it as `indirect` or `indirect[bounces=1]`"));
            }
        }
    }
}

/// `None` for a file that isn't there.
fn read_json<T: DeserializeOwned>(path: &Path) -> Checked<Option<T>> {
    let shown = path.display();
    let text = match files::read_text(path, files::TEXT) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Diagnostic::error(format!("can't read {shown}: {e}")).into()),
    };
    Ok(Some(serde_json::from_str(&text).map_err(|e| Diagnostic::error(format!("{shown}: {e}")))?))
}

/// `output[name=value,…]` in parts.
fn output(text: &str) -> Option<(String, Vec<(String, String)>)> {
    let Some((output, rest)) = text.split_once('[') else { return Some((text.to_string(), vec![])) };
    let conditions = rest.strip_suffix(']')?.split(',').map(|c| {
        let (name, value) = c.split_once('=')?;
        Some((name.trim().to_string(), value.trim().to_string()))
    });
    Some((output.trim().to_string(), conditions.collect::<Option<_>>()?))
}

impl LoadedReference {
    /// Whether it applies to a setting.
    pub fn applies(&self, params: &BTreeMap<String, String>) -> bool {
        self.only_when.iter().all(|(name, value)| params.get(name) == Some(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn manifest(entries: &str, comparison: &str) -> Manifest {
        let entries = serde_json::from_str(entries).unwrap();
        Manifest { folder: "nowhere".into(), entries, comparison: serde_json::from_str(comparison).unwrap() }
    }

    #[test]
    fn a_name_is_an_output_and_conditions() {
        assert_eq!(output("color"), Some(("color".into(), vec![])));
        assert_eq!(output("indirect[bounces=1]"), Some(("indirect".into(), vec![("bounces".into(), "1".into())])));
        assert_eq!(output("indirect[bounces"), None);
        assert_eq!(output("indirect[bounces]"), None);
    }

    #[test]
    fn an_exact_radiance_applies_by_parameter() {
        let m = manifest(
            r#"[{"scene": "f", "camera": "in", "exact": {"full": 2.0, "b1": 1.5}}]"#,
            r#"{"outputs": {"full": "color", "b1": "color[bounces=1]"}}"#,
        );
        let found = m.load("f", Some("in"), [2, 2], &mut vec![]).unwrap();
        let fits = |n: &str| {
            let params = BTreeMap::from([("bounces".to_string(), n.to_string())]);
            let mut values: Vec<f32> =
                found.all.iter().filter(|r| r.applies(&params)).map(|r| r.image.data[0]).collect();
            values.sort_by(f32::total_cmp);
            values
        };
        assert_eq!((fits("1"), fits("2")), (vec![1.5, 2.0], vec![2.0]));
        assert!(m.load("f", None, [2, 2], &mut vec![]).unwrap().all.is_empty());
    }

    #[test]
    fn dark_cameras_are_no_view_of_their_own() {
        let m = manifest(
            r#"[{"scene": "r", "camera": "lit"}, {"scene": "r", "camera": "dark"}, {"scene": "f"}]"#,
            r#"{"leaks": [{"scene": "r", "lit": "lit", "dark": "dark"}]}"#,
        );
        assert_eq!(m.views(), [("r".into(), Some("lit".into())), ("f".into(), None)]);
        assert!(m.load("r", Some("lit"), [1, 1], &mut vec![]).unwrap().leak.is_some());
    }

    #[test]
    fn missing_files_are_faults_all_at_once() {
        let m = manifest(
            r#"[{"scene": "f", "files": {"a": "missing-a.exr", "b": "missing-b.exr"}, "exact": {"c": 1.0}}]"#,
            r#"{"outputs": {"c": "c["}}"#,
        );
        assert_eq!(m.load("f", None, [2, 2], &mut vec![]).unwrap_err().0.len(), 3);
        assert!(Manifest::read(Path::new("no/such/folder")).unwrap().entries.is_empty());
    }
}
