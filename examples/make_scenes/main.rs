//! Writes the scenes under `scenes/`, and the panorama of `graphs/play`: `cargo run --example make_scenes [--
//! OUT_DIR]`.
//!
//! The same bytes on every run: there is no randomness, and coordinates are rounded where systems' mathematics differ.
//! It shares no code with lightgraph's scene reader, so that one can check the other.

mod apartment;
mod atrium;
mod board;
mod corridor;
mod figure;
mod gallery;
mod glb;
mod hall;
mod lamps;
mod mesh;
mod moves;
mod open_air;
mod paintings;
mod rooms;
mod shapes;
mod street;
mod studio;
mod workshop;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// A file of `scenes/`, or of another folder of the repository.
struct SceneFile {
    folder: &'static str,
    name: String,
    bytes: Vec<u8>,
    /// `None` for a file that is not geometry.
    triangles: Option<usize>,
}

/// Every generated file, in the order of the README's table.
fn outputs() -> Vec<SceneFile> {
    let geometry = [
        ("cornell", rooms::cornell()),
        ("hall", hall::hall()),
        ("art_gallery", gallery::gallery()),
        ("corridor", corridor::corridor()),
        ("apartment", apartment::apartment()),
        ("atrium", atrium::atrium()),
        ("street", street::street()),
        ("workshop", workshop::workshop()),
        ("furnace", rooms::furnace(0.5)),
        ("furnace_80", rooms::furnace(0.8)),
        ("furnace_95", rooms::furnace(0.95)),
        ("empty_room", rooms::empty_room()),
        ("two_rooms", rooms::two_rooms()),
        ("lambert_plane", rooms::lambert_plane()),
        ("metal_balls", rooms::metal_balls()),
        ("lamps_1", lamps::lamps(1)),
        ("lamps_16", lamps::lamps(16)),
        ("lamps_64", lamps::lamps(64)),
        ("lamps_256", lamps::lamps(256)),
        ("lamps_1024", lamps::lamps(1024)),
        ("sky_ball", open_air::sky_ball()),
        ("yard", open_air::yard()),
        ("materials", board::board()),
        ("moves", moves::moves()),
    ];
    let mut out: Vec<SceneFile> = geometry
        .into_iter()
        .map(|(name, document)| SceneFile {
            folder: "scenes",
            name: format!("{name}.glb"),
            triangles: Some(document.triangle_count()),
            bytes: document.finish(),
        })
        .collect();
    for (name, text) in [
        ("hall.ron", hall::SCENE),
        ("hall_glossy.ron", hall::GLOSSY),
        ("hall_moving.ron", hall::MOVING),
        ("art_gallery.ron", gallery::SCENE),
        ("apartment.ron", apartment::SCENE),
        ("apartment_overcast.ron", apartment::OVERCAST),
        ("atrium.ron", atrium::SCENE),
        ("street.ron", street::SCENE),
        ("workshop.ron", workshop::SCENE),
        ("lambert_plane.ron", rooms::PLANE_SCENE),
        ("metal_balls.ron", rooms::BALLS_SCENE),
        ("phong_balls.ron", rooms::PHONG_BALLS),
        ("sky_ball.ron", open_air::BALL_SCENE),
        ("yard_evening.ron", open_air::YARD_SCENE),
        ("materials.ron", board::SCENE),
    ] {
        let bytes = text.as_bytes().to_vec();
        out.push(SceneFile { folder: "scenes", name: name.to_string(), bytes, triangles: None });
    }
    for (folder, name, bytes) in [
        ("graphs/play", "studio.hdr", studio::studio()),
        ("scenes", "materials.hdr", board::panorama()),
        ("scenes", "street.hdr", street::sky()),
    ] {
        out.push(SceneFile { folder, name: name.to_string(), bytes, triangles: None });
    }
    out
}

fn write(directory: &Path, output: &SceneFile) -> std::io::Result<()> {
    std::fs::create_dir_all(directory)?;
    std::fs::write(directory.join(&output.name), &output.bytes)
}

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let directory = arguments.next().map(PathBuf::from);
    let flag = directory.as_ref().is_some_and(|d| d.as_os_str().to_string_lossy().starts_with('-'));
    if arguments.next().is_some() || flag {
        eprintln!("usage: make_scenes [OUT_DIR]");
        return ExitCode::from(2);
    }
    for output in outputs() {
        let directory = directory.as_deref().unwrap_or(Path::new(output.folder));
        if let Err(error) = write(directory, &output) {
            eprintln!("error: cannot write {}: {error}", directory.join(&output.name).display());
            return ExitCode::FAILURE;
        }
        let triangles = output.triangles.map_or_else(String::new, |n| format!("{n:>7} triangles"));
        println!("{:<18} {:>9} bytes {triangles}", output.name, output.bytes.len());
    }
    ExitCode::SUCCESS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn committed_scenes_are_what_this_program_writes() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let stale: Vec<String> = outputs()
            .into_iter()
            .filter(|output| {
                std::fs::read(root.join(output.folder).join(&output.name)).ok().as_ref() != Some(&output.bytes)
            })
            .map(|output| output.name)
            .collect();
        assert!(stale.is_empty(), "out of date: {stale:?}; `cargo run --example make_scenes` writes them anew");
    }

    #[test]
    fn two_runs_give_the_same_bytes() {
        for (first, second) in outputs().iter().zip(&outputs()) {
            assert!(first.bytes == second.bytes, "{} differs between two runs", first.name);
        }
    }

    #[test]
    fn triangle_counts_and_sizes_are_as_stated() {
        for (name, wanted) in [("hall.glb", 8_000.0), ("art_gallery.glb", 80_000.0)] {
            let outputs = outputs();
            let output = outputs.iter().find(|o| o.name == name).expect("listed above");
            let count = output.triangles.expect("geometry") as f64;
            assert!((count / wanted - 1.0).abs() <= 0.02, "{name} has {count} triangles, not {wanted} within 2 %");
            assert!(output.bytes.len() <= 1_400_000, "{name} takes {} bytes", output.bytes.len());
        }
    }
}
