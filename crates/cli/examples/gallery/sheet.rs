//! Pictures of tiles side by side.

use crate::list::{Tile, TilePicture};
use crate::measure::GalleryBench;
use lightgraph::internals::image::exr::read_exr;
use lightgraph::internals::image::png::{ToneMap, write_png};
use lightgraph::{Checked, Diagnostic, Image};
use std::collections::BTreeMap;
use std::path::Path;

/// White pixels between tiles.
const GAP: u32 = 4;

pub fn draw(picture: &TilePicture, bench: &mut GalleryBench<'_>) -> Checked<()> {
    let count = picture.tiles.len() as u32;
    let columns = if picture.columns == 0 { count } else { picture.columns };
    let (width, height) = picture.size;
    let along = |n: u32, edge: u32| n * (edge + GAP) - GAP;
    // As white as a tone map lets it be.
    let white = [1e4_f32; 3];
    let mut sheet = Image::filled(along(columns, width), along(count.div_ceil(columns), height), &white)?;
    for (i, tile) in (0_u32..).zip(&picture.tiles) {
        let image = match tile {
            Tile::Graph { graph, scene, set, output } => bench.rendered(graph, scene, set, output, [width, height])?.0,
            Tile::Reference(name) => read_exr(&Path::new("tests/references").join(format!("{name}.exr")))?,
        };
        let (left, top) = (i % columns * (width + GAP), i / columns * (height + GAP));
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            // A reference is smaller than its tile, or as large.
            let at = image.pixel(0, x * image.width / width, y * image.height / height);
            let to = sheet.pixel_mut(0, left + x, top + y);
            let (Some(from), Some(to)) = (at, to) else {
                return Err(Diagnostic::error(format!("`{}`: tile {i} has no pixel {x}, {y}", picture.name)).into());
            };
            to.copy_from_slice(&from[..3]);
        }
    }
    let path = Path::new("docs/images").join(format!("{}.png", picture.name));
    println!("{}", path.display());
    write_png(&path, &sheet, ToneMap::default(), picture.exposure, &BTreeMap::new())
}
