//! Files that the window writes: pictures, parameters as a variant, the whole choice.

use super::choice::{SplitLayout, ViewChoice};
use super::feed::ViewState;
use super::state::Save;
use lightgraph::internals::gpu;
use lightgraph::internals::image::difference;
use lightgraph::internals::image::exr::{Precision, write_exr};
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::internals::value::{Value, Values};
use lightgraph::{Checked, Diagnostic, Faults, Gpu, Image};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What is seen, to be written.
pub struct Saved<'a> {
    pub gpu: &'a Gpu,
    pub adapter: &'a str,
    pub choice: &'a ViewChoice,
    pub told: &'a ViewState,
    /// Where pictures and states go.
    pub folder: &'a Path,
}

impl Saved<'_> {
    /// Writes a file under a name that is free. Returns its path.
    ///
    /// # Errors
    /// There is nothing to write yet, or the file can't be written.
    pub fn write(&self, what: Save) -> Checked<PathBuf> {
        let (choice, folder) = (self.choice, self.folder);
        let stem = choice.graph.file_stem().map_or("picture".into(), |s| s.to_string_lossy().into_owned());
        let path = match what {
            Save::Png => {
                let path = free(folder, &stem, "png");
                let (image, tone_map, exposure) = self.seen()?;
                write_png(&path, &image, tone_map, exposure, &self.metadata())?;
                path
            }
            Save::Exr => {
                let path = free(folder, &stem, "exr");
                write_exr(&path, &[("", &self.read(self.told.image.as_ref())?)], Precision::Float, &self.metadata())?;
                path
            }
            Save::Variant => {
                let subject = self.told.subject.as_ref().ok_or_else(nothing)?;
                variant(&subject.path, &subject.params)?
            }
            Save::Choice => {
                let path = free(folder, &format!("{stem}.view"), "ron");
                choice.save(&path)?;
                path
            }
        };
        Ok(path)
    }

    /// The image as it is seen: in linear light, with the tone map and exposure to write it with.
    fn seen(&self) -> Checked<(Image, ToneMap, f32)> {
        let (choice, told) = (self.choice, self.told);
        let shown = (choice.tone_map, choice.stops(told.automatic));
        let mut image = self.read(told.image.as_ref())?;
        let Some(other) = &told.other else { return Ok((image, shown.0, shown.1)) };
        let other = self.read(Some(other))?;
        match choice.compare.layout {
            SplitLayout::Other => image = other,
            SplitLayout::Difference(_) => {
                return Ok((difference::difference(&image, &other)?.image, ToneMap::None, 0.0));
            }
            SplitLayout::Split(at) => {
                let first = (at * image.width as f32).round() as u32;
                for y in 0..image.height {
                    for x in first..image.width {
                        let from = other.pixel(0, x * other.width / image.width, y * other.height / image.height);
                        if let (Some(from), Some(to)) = (from.map(<[f32]>::to_vec), image.pixel_mut(0, x, y)) {
                            to.iter_mut().zip(from).for_each(|(to, from)| *to = from);
                        }
                    }
                }
            }
        }
        Ok((image, shown.0, shown.1))
    }

    fn read(&self, texture: Option<&wgpu::Texture>) -> Checked<Image> {
        gpu::read_plane(self.gpu, texture.ok_or_else(nothing)?, "the image", 0, 0)
    }

    fn metadata(&self) -> BTreeMap<String, String> {
        let Some(subject) = &self.told.subject else { return BTreeMap::new() };
        let parameter = |n: &String| subject.plan.value(n).map(|v| format!("{n}={v}"));
        let parameters: Vec<String> = subject.plan.params.iter().filter_map(parameter).collect();
        BTreeMap::from([
            ("graph".into(), subject.plan.graph.clone()),
            ("scene".into(), subject.scene.name.clone()),
            ("parameters".into(), parameters.join("; ")),
            ("adapter".into(), self.adapter.to_string()),
            ("version".into(), env!("CARGO_PKG_VERSION").to_string()),
        ])
    }
}

/// The fault of whoever asks for an image too early.
pub fn nothing() -> Faults {
    Diagnostic::error("there is no image yet").into()
}

/// The first of `STEM.ENDING`, `STEM_2.ENDING`, `STEM_3.ENDING` … in a folder that is not there yet.
pub fn free(folder: &Path, stem: &str, ending: &str) -> PathBuf {
    let numbered = |n: u32| if n == 1 { format!("{stem}.{ending}") } else { format!("{stem}_{n}.{ending}") };
    let mut n = 1;
    while folder.join(numbered(n)).exists() {
        n += 1;
    }
    folder.join(numbered(n))
}

/// Writes parameters as a variant beside its base; returns its path.
///
/// # Errors
/// Nothing to write, or the file can't be written.
pub fn variant(base: &Path, params: &Values) -> Checked<PathBuf> {
    if params.is_empty() {
        let d = Diagnostic::error("no parameter differs from the graph's defaults");
        return Err(d.help("set one first").into());
    }
    let name = |p: Option<&std::ffi::OsStr>| p.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let path = free(base.parent().unwrap_or(Path::new("")), &format!("{}_set", name(base.file_stem())), "ron");
    write_atomically(&path, text(&name(base.file_name()), params).as_bytes())?;
    Ok(path)
}

fn text(base: &str, params: &Values) -> String {
    let names: Vec<&str> = params.keys().map(String::as_str).collect();
    let defaults: String =
        params.iter().map(|(n, v)| format!("        \"{n}\": (default: {}),\n", literal(*v))).collect();
    let about = format!("{} with other defaults: {}", base.trim_end_matches(".ron"), names.join(", "));
    format!("Variant(\n    base: \"{base}\",\n    about: \"{about}\",\n    params: {{\n{defaults}    }},\n)\n")
}

/// A value as graph files write it.
fn literal(value: Value) -> String {
    let number = |x: f32| format!("{x:?}");
    let all = |v: &[f32]| format!("({})", v.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "));
    match value {
        Value::Float(v) => number(v),
        Value::Vec2(v) => all(&v.to_array()),
        Value::Vec3(v) => all(&v.to_array()),
        Value::Vec4(v) => all(&v.to_array()),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightgraph::internals::diag::Source;
    use lightgraph::internals::graph;

    const BASE: &str = r#"Graph(
        about: "a",
        params: {
            "n": Uint(default: 1), "x": Float(default: 0.5), "on": Bool(default: false),
            "grid": UVec3(default: (4, 4, 4)), "tint": Vec3(default: (1, 1, 1)),
        },
        resources: {"color": Texture(format: Rgba32Float, size: "screen")},
        passes: [Screen(name: "p", shader: "p.wgsl", color: "color")],
        outputs: {"color": "color"},
    )"#;

    #[test]
    fn a_saved_variant_has_the_values_as_defaults() {
        let values = Values::from([
            ("n".into(), Value::Uint(7)),
            ("x".into(), Value::Float(1e-7)),
            ("on".into(), Value::Bool(true)),
            ("grid".into(), Value::UVec3([1, 2, 3].into())),
            ("tint".into(), Value::Vec3([0.25, 1.0, 3.5].into())),
        ]);
        let variant = text("base.ron", &values);
        let read = |path: &Path| {
            Ok(Source::new(path.display().to_string(), if path.ends_with("v.ron") { variant.as_str() } else { BASE }))
        };
        let graph = graph::load(Path::new("v.ron"), &read).unwrap_or_else(|f| panic!("{f}\n{variant}"));
        for (name, param) in &graph.params {
            assert_eq!(Some(&param.default), values.get(&name.value), "{}", name.value);
        }
    }

    #[test]
    fn files_that_are_there_are_not_written_over() {
        let folder = std::env::temp_dir().join(format!("lightgraph-free-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        for name in ["a.png", "a_2.png"] {
            std::fs::write(folder.join(name), "").unwrap();
        }
        let found = free(&folder, "a", "png");
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(found, folder.join("a_3.png"));
    }
}
