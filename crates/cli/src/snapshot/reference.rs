//! What a test expects, in files beside it: compared, shown where it differs, blessed where asked.

use super::check::Limits;
use super::file::Test;
use super::{FailedCheck, TestOptions};
use lightgraph::internals::files;
use lightgraph::internals::image::difference::difference;
use lightgraph::internals::image::exr::{Precision, read_exr, write_exr};
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::{Checked, Diagnostic, Image};
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Which references are written anew, where they do not match.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Bless {
    None,
    All,
    /// Those of the test of this name.
    Named(String),
}

/// A picture to look at.
#[derive(Debug, Clone)]
pub struct TestPicture {
    pub name: &'static str,
    pub png: PathBuf,
}

/// The result of a comparison with a file.
pub enum Compared {
    Equal,
    Differs(FailedCheck),
    /// What changed.
    Blessed(String),
}

/// An image reference may hold this many bytes before compression.
const LARGEST: u64 = 64 << 10;

/// The files of one test.
pub struct ReferenceFiles<'a> {
    pub test: &'a Test,
    pub name: &'a str,
    pub options: &'a TestOptions,
    /// The test has run out of time, and failed: no file may change any more.
    pub late: &'a AtomicBool,
}

impl ReferenceFiles<'_> {
    /// Compares a text with the reference of this ending.
    ///
    /// # Errors
    /// Files that can't be read or written.
    pub fn text(&self, ending: &str, title: &str, actual: &str) -> Checked<Compared> {
        self.in_time()?;
        let path = self.beside(ending);
        let shown = path.display();
        let expected = match path.is_file() {
            true => match files::read_text(&path, files::TEXT) {
                Ok(text) => Some(text),
                // One that can't be read is replaced where that is meant.
                Err(_) if self.blesses() => None,
                Err(e) => return Err(unreadable(&path, &e).into()),
            },
            false => None,
        };
        if expected.as_deref() == Some(actual) {
            return Ok(Compared::Equal);
        }
        let changes = expected.as_deref().map(|e| lines_that_differ(e, actual));
        if self.blesses() {
            write_atomically(&path, actual.as_bytes())?;
            let what = changes.map_or("new".into(), |c| format!("{} lines changed", c.lines().count()));
            return Ok(Compared::Blessed(format!("{shown}: {what}")));
        }
        write_atomically(&self.failed(&format!("actual.{ending}")), actual.as_bytes())?;
        let why = match changes {
            Some(changes) => format!("it differs from {shown}\n{changes}"),
            None => format!("there is no reference {shown}"),
        };
        Ok(Compared::Differs(failure(title, why, vec![])))
    }

    /// Compares an image with the reference of this stem.
    ///
    /// # Errors
    /// Files that can't be read or written; an image that is too large to be kept.
    pub fn image(&self, stem: &str, title: &str, actual: &Image, limits: &Limits) -> Checked<Compared> {
        self.in_time()?;
        let path = self.beside(&format!("{stem}.exr"));
        let actual = &flat(actual)?;
        let expected = match path.is_file() {
            // One that can't be read is replaced where that is meant.
            true => read_exr(&path).map(Some).or_else(|faults| if self.blesses() { Ok(None) } else { Err(faults) })?,
            false => None,
        };
        let why = match &expected {
            Some(expected) => match limits.hold(actual, expected) {
                Ok(()) => return Ok(Compared::Equal),
                Err(why) => why,
            },
            None => format!("there is no reference {}", path.display()),
        };
        if self.blesses() {
            let bytes = actual.data.len() as u64 * 2;
            if bytes > LARGEST {
                let d = Diagnostic::error(format!("a reference of {bytes} bytes is too large for a test"));
                return Err(d.help("render a smaller image: 96 × 96 pixels fit").into());
            }
            if let Some(bad) = actual.non_finite(None) {
                return Err(Diagnostic::error(format!("an image can't be blessed that holds {bad}")).into());
            }
            write_exr(&path, &[("", actual)], Precision::Half, &BTreeMap::new())?;
            let what = if expected.is_some() { why } else { format!("new, {} × {}", actual.width, actual.height) };
            return Ok(Compared::Blessed(format!("{}: {what}", path.display())));
        }
        let pictures = self.pictures(stem, actual, expected.as_ref())?;
        Ok(Compared::Differs(failure(title, why, pictures)))
    }

    /// Writes what there is to see of an image that differs from what is expected.
    ///
    /// # Errors
    /// Files that can't be written.
    pub fn pictures(&self, stem: &str, actual: &Image, expected: Option<&Image>) -> Checked<Vec<TestPicture>> {
        self.in_time()?;
        let none = BTreeMap::new();
        // Images of another size have no difference to show.
        let shown = expected.and_then(|e| difference(actual, e).ok());
        let difference = shown.as_ref().map(|d| &d.image);
        let all = [("actual", Some(actual)), ("expected", expected), ("difference", difference)];
        let mut pictures = vec![];
        for (name, image) in all {
            let Some(image) = image else { continue };
            let png = self.failed(&format!("{stem}.{name}.png"));
            let map = if name == "difference" { ToneMap::None } else { ToneMap::default() };
            write_exr(&png.with_extension("exr"), &[("", image)], Precision::Float, &none)?;
            write_png(&png, image, map, 0.0, &none)?;
            pictures.push(TestPicture { name, png });
        }
        Ok(pictures)
    }

    fn in_time(&self) -> Checked<()> {
        match self.late.load(Ordering::Relaxed) {
            true => Err(Diagnostic::error("the time limit is over").into()),
            false => Ok(()),
        }
    }

    fn blesses(&self) -> bool {
        match &self.options.bless {
            Bless::None => false,
            Bless::All => true,
            Bless::Named(name) => name == self.name,
        }
    }

    fn beside(&self, ending: &str) -> PathBuf {
        self.test.path.with_extension(ending)
    }

    fn failed(&self, file: &str) -> PathBuf {
        let inside = Path::new(self.name).components().filter(|c| matches!(c, Component::Normal(_)));
        self.options.failures.join(inside.collect::<PathBuf>()).join(file)
    }
}

/// Layers below each other, red, green and blue only: what a reference keeps.
pub fn flat(image: &Image) -> Checked<Image> {
    Image::new(image.width, image.height.saturating_mul(image.layers), 3, image.rgb().flatten().collect())
}

pub fn failure(title: &str, why: String, pictures: Vec<TestPicture>) -> FailedCheck {
    FailedCheck { title: title.into(), why, reason: String::new(), pictures, blessable: true }
}

fn unreadable(path: &Path, e: &std::io::Error) -> Diagnostic {
    Diagnostic::error(format!("can't read {}: {e}", path.display()))
}

/// Pairs of lines that are compared at most: the table of them takes 8 bytes each.
const MOST_COMPARED: usize = 16 << 20;

/// The lines that only one of two texts has (`-` the old, `+` the new), by their longest common subsequence.
fn lines_that_differ(old: &str, new: &str) -> String {
    let (a, b): (Vec<&str>, Vec<&str>) = (old.lines().collect(), new.lines().collect());
    let alike = a.iter().zip(&b).take_while(|(a, b)| a == b).count();
    let ends = a[alike..].iter().rev().zip(b[alike..].iter().rev()).take_while(|(a, b)| a == b).count();
    let (a, b) = (&a[alike..a.len() - ends], &b[alike..b.len() - ends]);
    if a.len().saturating_mul(b.len()) > MOST_COMPARED {
        return format!("{} lines and {} lines differ, from line {} on", a.len(), b.len(), alike + 1);
    }
    // common[i][j]: the most lines that a[i..] and b[j..] share in order.
    let mut common = vec![vec![0usize; b.len() + 1]; a.len() + 1];
    for i in (0..a.len()).rev() {
        for j in (0..b.len()).rev() {
            common[i][j] = if a[i] == b[j] { common[i + 1][j + 1] + 1 } else { common[i + 1][j].max(common[i][j + 1]) };
        }
    }
    let (mut i, mut j, mut out) = (0, 0, vec![]);
    while i < a.len() || j < b.len() {
        if i < a.len() && j < b.len() && a[i] == b[j] {
            (i, j) = (i + 1, j + 1);
        } else if j == b.len() || (i < a.len() && common[i + 1][j] >= common[i][j + 1]) {
            out.push(format!("- {}", a[i]));
            i += 1;
        } else {
            out.push(format!("+ {}", b[j]));
            j += 1;
        }
    }
    out.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_that_differ_are_few() {
        let (old, new) = ("a\nb\nc\nd", "a\nx\nc\nd\ne");
        assert_eq!(lines_that_differ(old, new), "- b\n+ x\n+ e");
        assert_eq!(lines_that_differ(old, old), "");
        assert_eq!(lines_that_differ("", "a"), "+ a");
        let (long, other) = ("a\n".repeat(100_000), "b\n".repeat(100_000));
        let text = lines_that_differ(&format!("x\n{long}"), &format!("x\n{other}"));
        assert_eq!(text, "100000 lines and 100000 lines differ, from line 2 on");
    }

    #[test]
    fn layers_stand_below_each_other() {
        let image = Image::array(1, 2, 2, 4, (0..16).map(|v| v as f32).collect()).unwrap();
        let flat = flat(&image).unwrap();
        assert_eq!((flat.width, flat.height, flat.layers, flat.channels), (1, 4, 1, 3));
        assert_eq!(flat.data, [0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 8.0, 9.0, 10.0, 12.0, 13.0, 14.0]);
    }
}
