//! The figures and pictures of docs/gallery.md and README.md, made anew: `cargo run --release --example gallery`.
//!
//! `docs/gallery.ron` lists them. A table takes the place of what stands between `<!-- table NAME -->` and
//! `<!-- end -->`; a picture is written to docs/images. Arguments choose tables and pictures by name.

mod list;
mod measure;
mod sheet;

use lightgraph::internals::image::file::write_atomically;
use lightgraph::{Checked, Diagnostic, Faults, Gpu};
use list::{Gallery, GalleryTable};
use measure::GalleryBench;
use std::path::Path;

const LIST: &str = "docs/gallery.ron";

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).collect();
    if let Err(faults) = run(&chosen) {
        eprintln!("{faults}");
        std::process::exit(1);
    }
}

fn run(chosen: &[String]) -> Checked<()> {
    let gallery = Gallery::read(Path::new(LIST))?;
    gallery.check(chosen)?;
    let wanted = |name: &str| chosen.is_empty() || chosen.iter().any(|c| c == name);
    let gpu = Gpu::open().map_err(Faults::from)?;
    let mut bench = GalleryBench::new(&gpu, gallery.size)?;
    // Lines of tables show those that are there.
    for picture in gallery.pictures.iter().filter(|p| wanted(&p.name)) {
        sheet::draw(picture, &mut bench)?;
    }
    for table in gallery.tables.iter().filter(|t| wanted(&t.name)) {
        let text = measured(table, &mut bench)?;
        for file in &table.files {
            place(Path::new(file), &table.name, &text)?;
        }
    }
    Ok(())
}

/// A table's text, as Markdown: a line a graph; error and time a scene.
fn measured(table: &GalleryTable, bench: &mut GalleryBench<'_>) -> Checked<String> {
    let short = |scene: &str| scene.split(['.', ':']).next().unwrap_or(scene).to_string();
    let described = table.rows.iter().any(|r| !r.what.is_empty());
    let scenes = table.scenes.iter().map(|s| short(s)).collect::<Vec<_>>().join(" | ");
    let first = if described { "| | graph | what it is | " } else { "| graph | " };
    let lines = if described { "|---|---|---|" } else { "|---|" };
    let mut text = format!("{first}{scenes} |\n{lines}{}\n", "---:|".repeat(table.scenes.len()));
    for row in &table.rows {
        let note = if row.note.is_empty() { String::new() } else { format!(", {}", row.note) };
        let name = format!("`{}`{note}", row.graph);
        text += &match described {
            true => {
                // Texts of the list go over several lines.
                let what = row.what.split_whitespace().collect::<Vec<_>>().join(" ");
                format!("| {} | {name} | {what} |", thumbnail(&row.graph))
            }
            false => format!("| {name} |"),
        };
        for scene in &table.scenes {
            let here = row.instead.is_empty() && (row.scenes.is_empty() || row.scenes.contains(scene));
            let cell = if here { bench.cell(table, row, scene)? } else { row.instead.clone() };
            println!("{} {} {scene}: {cell}", row.graph, row.set);
            text += &format!(" {cell} |");
        }
        text += "\n";
    }
    Ok(format!("{text}\n*{}*\n", bench.conditions()))
}

/// A small picture of what a graph renders, for files in the project's root; empty without one.
fn thumbnail(graph: &str) -> String {
    let path = format!("docs/images/gallery/{graph}.png");
    if Path::new(&path).exists() { format!("![]({path})") } else { String::new() }
}

/// Puts a text between a file's marks.
fn place(file: &Path, name: &str, text: &str) -> Checked<()> {
    let fault = |why: String| Diagnostic::error(format!("{}: {why}", file.display()));
    let old = std::fs::read_to_string(file).map_err(|e| fault(e.to_string()))?;
    let begin = format!("<!-- table {name} -->\n");
    let end = "<!-- end -->";
    let placed = old.split_once(&begin).and_then(|(before, rest)| {
        let (_, after) = rest.split_once(end)?;
        Some(format!("{before}{begin}{text}{end}{after}"))
    });
    let placed = placed.ok_or_else(|| fault(format!("`{}` … `{end}` is missing", begin.trim())))?;
    write_atomically(file, placed.as_bytes())
}
