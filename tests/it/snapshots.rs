//! One tiny picture of the whole, beside the physics: it catches what averages hide, such as a flipped axis.
//!
//! `LIGHTGRAPH_BLESS=1 cargo test snapshot` writes the expected image anew; look at it before you keep it.

use crate::device::Shot;
use crate::support::repository;
use lightgraph::internals::image::difference::difference;
use lightgraph::internals::image::exr::{Precision, read_exr, write_exr};
use lightgraph::internals::image::metrics::compare;
use lightgraph::internals::image::png::{ToneMap, write_png};
use std::collections::BTreeMap;
use std::path::Path;

/// Percent RMSE. Drivers round, and cover a pixel at an edge, in their own ways: two software drivers differ by about a
/// pixel in a thousand, which is 1 %; a probe or a face in the wrong place is 10 % and more.
const THRESHOLD: f64 = 2.0;

#[test]
fn snapshot_of_a_lit_box() {
    let set = "grid=4,4,4 face=8 bounces=3 epsilon=0 shadow_size=256";
    let shot = Shot { set, ..Shot::new("graphs/gi/uniform_grid.ron", "scenes/cornell.glb", 64) };
    let [actual] = shot.render(["color"]);
    let path = repository("tests/images/cornell_uniform_grid.exr");
    let none = BTreeMap::new();
    if std::env::var_os("LIGHTGRAPH_BLESS").is_some() {
        // Half floats: 0.05 % is far below the threshold, and the file stays below 64 KiB.
        write_exr(&path, &[("", &actual)], Precision::Half, &none).unwrap_or_else(|f| panic!("{f}"));
    }
    let expected = read_exr(&path).unwrap_or_else(|f| panic!("{f}"));
    let metrics = compare(&actual, &expected, None).unwrap_or_else(|f| panic!("{f}"));
    if metrics.rmse_percent <= THRESHOLD {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("snapshot_of_a_lit_box");
    let shown = difference(&actual, &expected).unwrap_or_else(|f| panic!("{f}"));
    let images = [("actual", &actual), ("expected", &expected), ("difference", &shown.image)];
    for (name, image) in images {
        let map = if name == "difference" { ToneMap::None } else { ToneMap::default() };
        write_exr(&folder.join(format!("{name}.exr")), &[("", image)], Precision::Float, &none)
            .and_then(|()| write_png(&folder.join(format!("{name}.png")), image, map, 0.0, &none))
            .unwrap_or_else(|f| panic!("{f}"));
    }
    panic!(
        "the image differs by {:.2} % RMSE (allowed: {THRESHOLD} %), bias {:+.2} %\n\
         actual, expected and difference (red: too bright, blue: too dark) are in {}\n\
         where the change is meant: LIGHTGRAPH_BLESS=1 cargo test snapshot",
        metrics.rmse_percent,
        metrics.bias_percent,
        folder.display()
    );
}
