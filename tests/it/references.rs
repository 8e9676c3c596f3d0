//! Against a path tracer that shares no code with this project: see `tests/references/README.md`.

use crate::device::Shot;
use crate::support::repository;
use lightgraph::image::Image;
use lightgraph::image::exr::read_exr;
use lightgraph::image::mask::{both, edge_mask, gradient_mask, grow};
use lightgraph::image::metrics::{Metrics, compare};

const SIZE: u32 = 128;

fn reference(name: &str) -> Image {
    read_exr(&repository(&format!("tests/references/{name}.exr"))).unwrap_or_else(|f| panic!("{f}"))
}

/// Direct light within 1 %, edges of surfaces and of shadows left out: there a pixel's centre decides, and the two
/// programs see it on different sides.
#[test]
fn direct_light_agrees_with_the_references() {
    for scene in ["cornell_point", "room_spot"] {
        let path = format!("scenes/{scene}.gltf");
        let [direct] = Shot::new("graphs/direct.ron", &path, SIZE).render(["direct"]);
        let expected = reference(&format!("{scene}_direct"));
        let [normal, depth, albedo] = ["normal", "depth", "albedo"].map(|what| reference(&format!("{scene}_{what}")));
        let surfaces = edge_mask(&normal, &depth, &albedo).unwrap_or_else(|f| panic!("{f}"));
        let shadows =
            gradient_mask(&expected, 0.5).and_then(|m| grow(&m, SIZE, SIZE, 1)).unwrap_or_else(|f| panic!("{f}"));
        let metrics = compare(&direct, &expected, Some(&both(&surfaces, &shadows))).unwrap_or_else(|f| panic!("{f}"));
        println!("{scene} direct: rmse {:.3} %, bias {:+.3} %", metrics.rmse_percent, metrics.bias_percent);
        assert!(metrics.pixels > 10_000, "{scene}: only {} pixels are compared", metrics.pixels);
        assert!(metrics.rmse_percent <= 1.0, "{scene}: {metrics:?}");
        assert!(metrics.bias_percent.abs() <= 0.5, "{scene}: {metrics:?}");
    }
}

/// What a grid without occlusion leaves when its probes hold the path tracer's converged light: percent of the mean,
/// over the pixels that show a surface; error, and bias where it is known. (Trilinear interpolation of the coefficients
/// in `cornell_point_probes_binf.json` leaves 25.4 % over these pixels, and 28.0 % with the black background.)
struct Band {
    scene: &'static str,
    set: &'static str,
    rmse: f64,
    bias: Option<f64>,
}

/// Percentage points by which an implementation may differ: it places texels and weighs probes in its own way.
const BAND: f64 = 3.0;

const fn band(scene: &'static str, set: &'static str, rmse: f64, bias: Option<f64>) -> Band {
    Band { scene, set, rmse, bias }
}

const BANDS: [Band; 6] = [
    band("cornell_point", "grid=4,4,4 inset=0.5", 25.5, Some(5.4)),
    band("cornell_point", "grid=4,4,4 inset=0.0625", 19.1, Some(-4.6)),
    band("cornell_point", "grid=8,8,8 inset=0.5", 20.4, Some(-3.7)),
    band("room_spot", "grid=4,4,4 inset=0.5", 45.4, None),
    band("room_spot", "grid=4,4,4 inset=0.0625", 34.2, None),
    band("room_spot", "grid=8,8,8 inset=0.5", 44.5, None),
];

#[test]
fn indirect_light_lies_in_its_bands() {
    let mut failures = vec![];
    for Band { scene, set, rmse, bias } in BANDS {
        let path = format!("scenes/{scene}.gltf");
        let settings = format!("{set} face=16 order=2 bounces=64 epsilon=0.001");
        let shot = Shot { set: &settings, ..Shot::new("graphs/uniform_grid.ron", &path, SIZE) };
        let [indirect] = shot.render(["indirect"]);
        let depth = reference(&format!("{scene}_depth"));
        let surfaces: Vec<bool> = depth.data.chunks(depth.channels as usize).map(|d| d[0] > 0.0).collect();
        let expected = reference(&format!("{scene}_indirect"));
        let metrics = compare(&indirect, &expected, Some(&surfaces)).unwrap_or_else(|f| panic!("{f}"));
        let Metrics { rmse_percent, bias_percent, .. } = metrics;
        let line =
            format!("{scene} {set}: rmse {rmse_percent:.1} % (about {rmse}), bias {bias_percent:+.1} % ({bias:?})");
        println!("{line}");
        if (rmse_percent - rmse).abs() > BAND || bias.is_some_and(|b| (bias_percent - b).abs() > BAND) {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The coefficients that the first bounce captures, against 16,384 rays a probe into the same scene.
/// Percent: √(Σ (test − reference)²) / √(Σ reference²) over all probes, coefficients and channels.
#[test]
fn probe_coefficients_agree_with_the_references() {
    for (scene, limit) in [("cornell_point", 5.0), ("room_spot", 5.0)] {
        let text = std::fs::read(repository(&format!("tests/references/{scene}_probes_b0.json"))).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&text).unwrap();
        let path = format!("scenes/{scene}.gltf");
        let set = "grid=4,4,4 inset=0.5 face=16 order=2 bounces=1";
        let [sh] = Shot { set, ..Shot::new("graphs/uniform_grid.ron", &path, 16) }.render(["sh"]);
        assert_eq!((sh.width, sh.height, sh.layers), (4, 4, 36));
        let (mut error, mut norm) = (0.0, 0.0);
        for (i, probe) in json["probes"].as_array().unwrap().iter().enumerate() {
            let (x, y, z) = (i as u32 % 4, i as u32 / 4 % 4, i as u32 / 16);
            for (coefficient, expected) in probe["sh"].as_array().unwrap().iter().enumerate() {
                let found = sh.pixel(z + 4 * coefficient as u32, x, y).unwrap();
                for channel in 0..3 {
                    let expected = expected[channel].as_f64().unwrap();
                    error += (f64::from(found[channel]) - expected).powi(2);
                    norm += expected * expected;
                }
            }
        }
        let percent = 100.0 * (error / norm).sqrt();
        println!("{scene}: coefficients differ by {percent:.2} %");
        assert!(percent <= limit, "{scene}: the coefficients differ by {percent:.2} %, more than {limit} %");
    }
}
