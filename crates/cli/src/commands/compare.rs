//! `lightgraph compare`: how far an image is from a reference.

use super::print;
use lightgraph::internals::image::difference::difference;
use lightgraph::internals::image::exr::read_exr;
use lightgraph::internals::image::flip::flip;
use lightgraph::internals::image::mask::{both, edge_mask, gradient_mask, grow};
use lightgraph::internals::image::metrics::{Metrics, compare};
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::{Checked, Diagnostic, Image};
use serde::Serialize;
use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
};

/// Compares an image with a reference: relative errors of linear light, and HDR-FLIP.
#[derive(Debug, Clone, clap::Args)]
#[command(group = clap::ArgGroup::new("masks").args(["mask_normal", "mask_gradient"]).multiple(true))]
pub struct CompareArgs {
    /// The image to judge (EXR)
    #[arg(value_name = "A")]
    pub test: PathBuf,
    /// The reference (EXR)
    #[arg(value_name = "B")]
    pub reference: PathBuf,
    /// Write a picture of A − B: red is too bright, blue too dark
    #[arg(long, value_name = "FILE.png")]
    pub difference: Option<PathBuf>,
    /// Leave out edges of surfaces: unit normals (EXR), with --mask-depth and --mask-albedo
    #[arg(long, value_name = "FILE.exr", requires = "mask_depth", requires = "mask_albedo")]
    pub mask_normal: Option<PathBuf>,
    /// Depths (EXR) for --mask-normal
    #[arg(long, value_name = "FILE.exr", requires = "mask_normal")]
    pub mask_depth: Option<PathBuf>,
    /// Albedos (EXR) for --mask-normal
    #[arg(long, value_name = "FILE.exr", requires = "mask_normal")]
    pub mask_albedo: Option<PathBuf>,
    /// Leave out pixels where the reference jumps by more than this share, from 0 to 1: edges of shadows
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub mask_gradient: Option<f32>,
    /// Leave out this many pixels round what the masks leave out
    #[arg(long, value_name = "PIXELS", default_value_t = 0, requires = "masks")]
    pub mask_grow: u32,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// What is printed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CompareReport {
    /// Relative and absolute errors.
    #[serde(flatten)]
    pub metrics: Metrics,
    /// Mean HDR-FLIP error, 0 to 1.
    pub flip: f64,
    /// Pixels of the image, compared or left out.
    pub of_pixels: u64,
}

/// Reads the images, compares them, writes the picture and prints the numbers. Returns the exit code, 0.
///
/// # Errors
/// A fault for each file that can't be read, and those of [`compare`], [`flip`] and the masks.
pub fn run(args: &CompareArgs) -> Checked<u8> {
    let (test, reference) = read_both(&args.test, &args.reference)?;
    if let Some(path) = &args.difference {
        write_difference(args, path, &test, &reference)?;
    }
    let mask = mask(args, &reference)?;
    let report = CompareReport {
        metrics: compare(&test, &reference, mask.as_deref())?,
        flip: flip(&test, &reference, mask.as_deref())?,
        of_pixels: test.pixel_count() as u64,
    };
    let fault = |e| Diagnostic::error(format!("can't print the result: {e}"));
    print(&match args.json {
        true => serde_json::to_string_pretty(&report).map_err(fault)? + "\n",
        false => report.to_string(),
    });
    Ok(0)
}

fn share(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| "it isn't a number".to_string())?;
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err("it isn't from 0 to 1".into()) }
}

/// Both images, or the faults of both files.
fn read_both(a: &Path, b: &Path) -> Checked<(Image, Image)> {
    match (read_exr(a), read_exr(b)) {
        (Ok(a), Ok(b)) => Ok((a, b)),
        (Err(mut a), Err(b)) => {
            a.0.extend(b.0);
            Err(a)
        }
        (Err(faults), _) | (_, Err(faults)) => Err(faults),
    }
}

fn write_difference(args: &CompareArgs, path: &Path, test: &Image, reference: &Image) -> Checked<()> {
    let shown = difference(test, reference)?;
    let metadata = [
        ("test", args.test.display().to_string()),
        ("reference", args.reference.display().to_string()),
        ("full colour", shown.full.to_string()),
    ];
    let metadata: BTreeMap<String, String> = metadata.map(|(k, v)| (k.to_string(), v)).into();
    write_png(path, &shown.image, ToneMap::None, 0.0, &metadata)
}

/// The pixels to compare; nothing when no mask is asked for.
fn mask(args: &CompareArgs, reference: &Image) -> Checked<Option<Vec<bool>>> {
    let mut mask: Option<Vec<bool>> = None;
    if let (Some(normal), Some(depth), Some(albedo)) = (&args.mask_normal, &args.mask_depth, &args.mask_albedo) {
        let (normal, depth) = read_both(normal, depth)?;
        mask = Some(edge_mask(&normal, &depth, &read_exr(albedo)?)?);
    }
    if let Some(threshold) = args.mask_gradient {
        let gradients = gradient_mask(reference, threshold)?;
        mask = Some(match mask {
            Some(edges) => both(&edges, &gradients),
            None => gradients,
        });
    }
    mask.map(|mask| grow(&mask, reference.width, reference.height, args.mask_grow)).transpose()
}

impl fmt::Display for CompareReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let m = &self.metrics;
        writeln!(f, "pixels compared  {} of {}", m.pixels, self.of_pixels)?;
        writeln!(f, "mean             {:.6} (reference {:.6})", m.mean_test, m.mean_reference)?;
        writeln!(f, "RMSE             {:.3} %", m.rmse_percent)?;
        writeln!(f, "  of 8 × 8 means {:.3} %", m.block_rmse_percent)?;
        writeln!(f, "bias             {:+.3} %", m.bias_percent)?;
        writeln!(f, "relMSE           {:.6}", m.relmse)?;
        writeln!(f, "95 % are within  {:.6}", m.p95_error)?;
        writeln!(f, "largest error    {:.6}", m.max_error)?;
        writeln!(f, "HDR-FLIP         {:.5}", self.flip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use lightgraph::internals::image::exr::{Precision, write_exr};
    use tempfile::TempDir;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: CompareArgs,
    }

    fn args(words: &[&str]) -> CompareArgs {
        Command::try_parse_from([&["compare"], words].concat()).unwrap().args
    }

    fn write(folder: &TempDir, name: &str, image: &Image) -> String {
        let path = folder.path().join(name);
        write_exr(&path, &[("", image)], Precision::Float, &BTreeMap::new()).unwrap();
        path.display().to_string()
    }

    #[test]
    fn two_files_are_compared_and_the_difference_is_written() {
        let folder = TempDir::new().unwrap();
        let a = write(&folder, "a.exr", &Image::filled(8, 8, &[0.5, 0.5, 0.5, 1.0]).unwrap());
        let b = write(&folder, "b.exr", &Image::filled(8, 8, &[0.4, 0.4, 0.4]).unwrap());
        let picture = folder.path().join("pictures/d.png").display().to_string();
        assert_eq!(run(&args(&[&a, &b, "--difference", &picture, "--json"])), Ok(0));
        assert!(Path::new(&picture).exists());
        assert_eq!(run(&args(&[&a, &b, "--mask-gradient", "0.5", "--mask-grow", "2"])), Ok(0));
    }

    #[test]
    fn masks_are_joined_and_grown() {
        let folder = TempDir::new().unwrap();
        let normal = write(&folder, "n.exr", &Image::filled(9, 9, &[0.0, 0.0, 1.0]).unwrap());
        let depth = write(&folder, "z.exr", &Image::filled(9, 9, &[1.0]).unwrap());
        let flags = ["a.exr", "b.exr", "--mask-normal", &normal, "--mask-depth", &depth, "--mask-albedo", &normal];
        let reference = Image::filled(9, 9, &[1.0]).unwrap();
        let kept = |flags: &[&str], reference: &Image| {
            mask(&args(flags), reference).unwrap().unwrap().iter().filter(|k| **k).count()
        };
        assert_eq!(kept(&flags, &reference), 49);
        assert_eq!(kept(&[&flags[..], &["--mask-grow", "1"]].concat(), &reference), 25);
        let mut step = reference.clone();
        step.pixel_mut(0, 4, 4).unwrap()[0] = 9.0;
        assert_eq!(kept(&[&flags[..], &["--mask-gradient", "0.5"]].concat(), &step), 40);
    }

    #[test]
    fn flags_that_do_nothing_are_refused() {
        let refused = |flag, value| Command::try_parse_from(["compare", "a", "b", flag, value]).is_err();
        assert!(refused("--mask-depth", "z.exr"));
        assert!(refused("--mask-normal", "n.exr"));
        assert!(refused("--mask-grow", "2"));
        assert!(refused("--mask-gradient", "1.5"));
        assert!(refused("--mask-gradient", "nan"));
        assert!(!refused("--mask-gradient", "0.5"));
    }

    #[test]
    fn every_missing_file_is_named() {
        let faults = run(&args(&["missing-a.exr", "missing-b.exr"])).unwrap_err();
        assert_eq!(faults.0.len(), 2);
    }

    #[test]
    fn the_table_names_unit_and_sign() {
        let image = |v| Image::filled(1, 1, &[v]).unwrap();
        let metrics = compare(&image(0.75), &image(1.0), None).unwrap();
        let text = CompareReport { metrics, flip: 0.25, of_pixels: 1 }.to_string();
        for line in [
            "pixels compared  1 of 1",
            "RMSE             25.000 %",
            "bias             -25.000 %",
            "HDR-FLIP         0.25000",
        ] {
            assert!(text.lines().any(|l| l == line), "{text}");
        }
    }
}
