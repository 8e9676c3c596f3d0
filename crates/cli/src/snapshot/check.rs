//! What a test holds, and how it is judged.

use super::file::ScriptRun;
use super::play::Played;
use lightgraph::internals::diag::Span;
use lightgraph::internals::graph::ast::Name;
use lightgraph::internals::image::flip::flip;
use lightgraph::internals::image::metrics::{Metrics, compare};
use lightgraph::{Image, Plan};

/// One thing that must hold.
#[derive(Debug, Clone)]
pub struct Check {
    pub span: Span,
    /// Why its numbers are what they are; may be empty where nothing is a matter of degree.
    pub reason: String,
    pub kind: CheckKind,
}

#[derive(Debug, Clone)]
pub enum CheckKind {
    /// The plan's text is that of the reference.
    Plan,
    /// Bytes of the plan's memory.
    Bytes { at_most: u64 },
    /// An output is near the reference.
    Image { output: Name, limits: Limits, per_adapter: bool },
    /// In the last frame these passes ran, and those were left out.
    Steps { ran: Vec<Name>, skipped: Vec<Name> },
    /// How often a loop went round when it last ran.
    Iterations { name: Name, min: u32, max: u32 },
    /// The mean over all pixels, red, green and blue; the tolerance is relative.
    Mean { output: Name, value: f64, tolerance: f64 },
    /// Every pixel has this value, up to a share of it.
    Constant { output: Name, value: [f64; 3], tolerance: f64 },
    /// The image is its own mirror image.
    Symmetric { output: Name, axis: MirrorAxis, limits: Limits },
    /// The mean is at most that of another run, times 1 + `slack`.
    NotBrighter { output: Name, than: ScriptRun, slack: f64 },
    /// The image is `factor` times that of another run.
    Times { output: Name, factor: f64, of: ScriptRun, limits: Limits },
    /// Every frame equals one that runs all steps, bit for bit.
    Incremental,
}

/// What a mirror swaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MirrorAxis {
    LeftRight,
    TopBottom,
}

/// How far an image may be from another; at least one is set.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Limits {
    /// Percent of the reference's mean.
    pub rmse: Option<f64>,
    /// Largest difference of a value, in the image's unit.
    pub max: Option<f64>,
    /// Difference that 95 % of the values don't exceed, in the image's unit.
    pub p95: Option<f64>,
    /// Mean HDR-FLIP, 0 to 1.
    pub flip: Option<f64>,
}

impl CheckKind {
    /// How a report calls it.
    pub fn title(&self) -> String {
        match self {
            CheckKind::Plan => "plan".into(),
            CheckKind::Bytes { .. } => "bytes".into(),
            CheckKind::Image { output, .. } => format!("image of `{}`", output.value),
            CheckKind::Steps { .. } => "steps".into(),
            CheckKind::Iterations { name, .. } => format!("iterations of `{}`", name.value),
            CheckKind::Mean { output, .. } => format!("mean of `{}`", output.value),
            CheckKind::Constant { output, .. } => format!("constant `{}`", output.value),
            CheckKind::Symmetric { output, .. } => format!("symmetry of `{}`", output.value),
            CheckKind::NotBrighter { output, .. } => format!("`{}` not brighter", output.value),
            CheckKind::Times { output, factor, .. } => format!("`{}` {factor} times another", output.value),
            CheckKind::Incremental => "incremental equals full".into(),
        }
    }

    /// Whether it takes an adapter.
    pub fn renders(&self) -> bool {
        !matches!(self, CheckKind::Plan | CheckKind::Bytes { .. })
    }

    /// The output that it looks at.
    pub fn output(&self) -> Option<&Name> {
        match self {
            CheckKind::Image { output, .. }
            | CheckKind::Mean { output, .. }
            | CheckKind::Constant { output, .. }
            | CheckKind::Symmetric { output, .. }
            | CheckKind::NotBrighter { output, .. }
            | CheckKind::Times { output, .. } => Some(output),
            CheckKind::Plan
            | CheckKind::Bytes { .. }
            | CheckKind::Steps { .. }
            | CheckKind::Iterations { .. }
            | CheckKind::Incremental => None,
        }
    }
}

impl Limits {
    /// Compares two images in linear light. `Err` says by how much the limits are exceeded.
    pub fn hold(&self, actual: &Image, expected: &Image) -> Result<(), String> {
        if actual == expected && actual.non_finite(None).is_none() {
            return Ok(());
        }
        let m = compare(actual, expected, None).map_err(|f| f.one_line())?;
        let Metrics { rmse_percent, max_error, p95_error, bias_percent, .. } = m;
        let flip = match self.flip {
            Some(_) => Some(flip(actual, expected, None).map_err(|f| f.one_line())?),
            None => None,
        };
        let measured = [
            ("rmse", Some(rmse_percent), self.rmse, " %"),
            ("max", Some(max_error), self.max, ""),
            ("p95", Some(p95_error), self.p95, ""),
            ("flip", flip, self.flip, ""),
        ];
        // A NaN is within no limit.
        let over = measured.iter().filter_map(|(name, value, limit, unit)| {
            let (value, limit) = value.zip(*limit)?;
            let within = value <= limit;
            (!within).then(|| format!("{name} {}{unit} (allowed {limit}{unit})", short(value)))
        });
        let over: Vec<String> = over.collect();
        match over.is_empty() {
            true => Ok(()),
            false => Err(format!("{}; bias {bias_percent:+.2} %", over.join(", "))),
        }
    }
}

/// Bytes of the plan's memory against the limit.
pub fn bytes(plan: &Plan, at_most: u64) -> Result<(), String> {
    let (bytes, _) = plan.bytes();
    if bytes <= at_most { Ok(()) } else { Err(format!("{bytes} bytes (allowed {at_most})")) }
}

/// Which passes ran in the last frame.
pub fn steps(played: &Played, ran: &[Name], skipped: &[Name]) -> Result<(), String> {
    let known = |n: &&Name| played.ran.contains(&n.value) || played.left_out.contains(&n.value);
    let mut wrong: Vec<String> =
        ran.iter().chain(skipped).filter(|n| !known(n)).map(|n| format!("there is no pass `{}`", n.value)).collect();
    let idle = ran.iter().filter(|n| known(n) && !played.ran.contains(&n.value));
    wrong.extend(idle.map(|n| format!("`{}` did not run", n.value)));
    wrong.extend(skipped.iter().filter(|n| played.ran.contains(&n.value)).map(|n| format!("`{}` ran", n.value)));
    if wrong.is_empty() { Ok(()) } else { Err(wrong.join(", ")) }
}

/// How often a loop went round.
pub fn iterations(played: &Played, name: &Name, min: u32, max: u32) -> Result<(), String> {
    match played.loops.get(&name.value) {
        Some(l) if (min..=max).contains(&l.iterations) => Ok(()),
        Some(l) => Err(format!("{} iterations (allowed {min} to {max})", l.iterations)),
        None => Err(format!("no loop `{}` ran", name.value)),
    }
}

/// The mean of an image against a value.
pub fn mean(image: &Image, value: f64, tolerance: f64) -> Result<(), String> {
    finite(image)?;
    let mean = mean_of(image);
    if (mean - value).abs() <= tolerance * value.abs() {
        return Ok(());
    }
    Err(format!("{}, expected {value} ± {} %", short(mean), 100.0 * tolerance))
}

/// Every pixel against a value.
pub fn constant(image: &Image, value: [f64; 3], tolerance: f64) -> Result<(), String> {
    finite(image)?;
    let scale = value.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let error = |p: &[f32; 3]| p.iter().zip(value).map(|(p, v)| (f64::from(*p) - v).abs()).fold(0.0, f64::max);
    let (width, height) = (image.width as usize, image.height as usize);
    let worst = image.rgb().enumerate().max_by(|a, b| error(&a.1).total_cmp(&error(&b.1)));
    match worst {
        Some((i, p)) if error(&p) > tolerance * scale => {
            let [r, g, b] = p.map(|v| short(v.into()));
            let (x, y) = (i % width, i / width % height);
            Err(format!("pixel ({x}, {y}) is ({r}, {g}, {b}), expected {value:?} ± {} %", 100.0 * tolerance))
        }
        _ => Ok(()),
    }
}

/// The mean of an image against that of another.
pub fn not_brighter(image: &Image, other: &Image, slack: f64) -> Result<(), String> {
    finite(image)?;
    finite(other)?;
    let (a, b) = (mean_of(image), mean_of(other));
    if a <= b * (1.0 + slack) {
        return Ok(());
    }
    Err(format!(
        "mean {} against {}: {:+.2} % (allowed {:+.2} %)",
        short(a),
        short(b),
        100.0 * (a / b - 1.0),
        100.0 * slack
    ))
}

/// The mirror image.
pub fn mirrored(image: &Image, axis: MirrorAxis) -> Image {
    let mut out = image.clone();
    for layer in 0..image.layers {
        for y in 0..image.height {
            for x in 0..image.width {
                let (from_x, from_y) = match axis {
                    MirrorAxis::LeftRight => (image.width - 1 - x, y),
                    MirrorAxis::TopBottom => (x, image.height - 1 - y),
                };
                if let (Some(to), Some(from)) = (out.pixel_mut(layer, x, y), image.pixel(layer, from_x, from_y)) {
                    to.copy_from_slice(from);
                }
            }
        }
    }
    out
}

/// The image with red, green and blue (and alpha) multiplied.
pub fn scaled(image: &Image, factor: f64) -> Image {
    let data = image.data.iter().map(|v| (f64::from(*v) * factor) as f32).collect();
    Image { data, ..*image }
}

fn mean_of(image: &Image) -> f64 {
    let sum: f64 = image.rgb().flatten().map(f64::from).sum();
    sum / (3 * image.pixel_count()) as f64
}

fn finite(image: &Image) -> Result<(), String> {
    match image.non_finite(None) {
        Some(bad) => Err(format!("it holds {bad}")),
        None => Ok(()),
    }
}

/// Four significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        let digits = (3.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Image {
        Image::new(2, 2, 3, vec![1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 4.0, 4.0, 4.0]).unwrap()
    }

    #[test]
    fn mirrors_swap_what_their_axis_says() {
        let red = |i: Image| i.rgb().map(|p| p[0]).collect::<Vec<_>>();
        assert_eq!(red(mirrored(&ramp(), MirrorAxis::LeftRight)), [2.0, 1.0, 4.0, 3.0]);
        assert_eq!(red(mirrored(&ramp(), MirrorAxis::TopBottom)), [3.0, 4.0, 1.0, 2.0]);
    }

    #[test]
    fn limits_name_what_is_exceeded_and_by_how_much() {
        let limits = Limits { max: Some(0.5), rmse: Some(90.0), ..Limits::default() };
        assert_eq!(limits.hold(&ramp(), &ramp()), Ok(()));
        let why = limits.hold(&scaled(&ramp(), 1.5), &ramp()).unwrap_err();
        assert_eq!(why, "max 2.000 (allowed 0.5); bias +50.00 %");
    }

    #[test]
    fn what_is_no_number_is_within_no_limit() {
        let mut bad = ramp();
        bad.data[4] = f32::NAN;
        let limits = Limits { max: Some(1e9), ..Limits::default() };
        assert!(limits.hold(&bad, &bad).is_err());
        assert!(mean(&bad, 2.5, 1e9).is_err());
        assert!(constant(&bad, [2.5; 3], 1e9).is_err());
        assert!(not_brighter(&ramp(), &bad, 1e9).is_err());
    }

    #[test]
    fn constants_and_means_are_relative() {
        assert_eq!(mean(&ramp(), 2.5, 0.0), Ok(()));
        assert_eq!(constant(&ramp(), [2.5; 3], 0.61), Ok(()));
        let why = constant(&ramp(), [2.5; 3], 0.5).unwrap_err();
        assert!(why.contains("is (4.000, 4.000, 4.000)") || why.contains("is (1.000, 1.000, 1.000)"), "{why}");
        assert_eq!(not_brighter(&ramp(), &scaled(&ramp(), 0.9), 0.12), Ok(()));
        assert!(not_brighter(&ramp(), &scaled(&ramp(), 0.9), 0.1).is_err());
    }
}
