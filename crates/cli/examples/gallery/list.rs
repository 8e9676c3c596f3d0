//! What the gallery shows, as a file says it.

use lightgraph::{Checked, Diagnostic, Faults};
use serde::Deserialize;
use std::path::Path;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gallery {
    /// Pixels along a side of what tables measure: those of the references.
    pub size: u32,
    pub tables: Vec<GalleryTable>,
    pub pictures: Vec<TilePicture>,
}

/// A line a graph, a column a scene.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GalleryTable {
    pub name: String,
    /// The files that it stands in.
    pub files: Vec<String>,
    /// Files in `scenes`; with `:CAMERA` where it is not the scene's own.
    pub scenes: Vec<String>,
    /// Parameters of all rows, `NAME=VALUE` apart by spaces; those that a graph doesn't have are left out.
    #[serde(default)]
    pub set: String,
    /// The output that is compared.
    pub output: String,
    pub rows: Vec<TableRow>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableRow {
    pub graph: String,
    /// On top of the table's.
    #[serde(default)]
    pub set: String,
    /// Said behind the graph's name.
    #[serde(default)]
    pub note: String,
    /// Stands in place of the figures of a graph that has none here.
    #[serde(default)]
    pub instead: String,
    /// What the graph is; lines that say so show a small picture, too.
    #[serde(default)]
    pub what: String,
    /// Those of the table's that it is measured on; none: all.
    #[serde(default)]
    pub scenes: Vec<String>,
}

/// Tiles side by side, in docs/images/NAME.png.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TilePicture {
    pub name: String,
    /// Width and height of a tile in pixels.
    pub size: (u32, u32),
    /// Tiles a line; 0: all.
    #[serde(default)]
    pub columns: u32,
    /// Stops.
    #[serde(default)]
    pub exposure: f32,
    pub tiles: Vec<Tile>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Tile {
    Graph {
        graph: String,
        scene: String,
        #[serde(default)]
        set: String,
        output: String,
    },
    /// An image of tests/references, of the tile's size or a part of it.
    Reference(String),
}

impl Gallery {
    pub fn read(path: &Path) -> Checked<Gallery> {
        let fault = |why: String| Diagnostic::error(format!("{}: {why}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| fault(e.to_string()))?;
        Ok(ron::from_str(&text).map_err(|e| fault(e.to_string()))?)
    }

    /// That every name that is asked for is a table's or a picture's.
    pub fn check(&self, chosen: &[String]) -> Checked<()> {
        let names = || self.tables.iter().map(|t| &t.name).chain(self.pictures.iter().map(|p| &p.name));
        let unknown = chosen.iter().filter(|c| !names().any(|n| n == *c));
        let fault =
            |c: &String| Diagnostic::error(format!("the gallery has no `{c}`")).nearest(c, names().map(String::as_str));
        Faults::check(unknown.map(fault).collect(), ())
    }
}
