//! A graph without a window, as a library: `cargo run --example headless -- out/headless.png`.

use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
use std::path::Path;

fn main() -> Checked<()> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "out/headless.png".into());
    draw(Path::new(&out))
}

/// The Cornell box by one bounce of light.
fn draw(out: &Path) -> Checked<()> {
    let gpu = Gpu::open()?;
    let project = Project::open(Path::new("lightgraph:graphs/gi/uniform_grid.ron"), &[])?;
    let scene = Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.glb"))?.scene;
    let params = project.params(&["bounces=1".into(), "grid=3".into(), "face=8".into()])?;
    let settings = Settings { params, size: [96, 96], ..Settings::default() };
    let mut session = Session::new(&gpu, &project, scene, settings)?;
    session.frame(&gpu, 0, 0.0)?;
    session.image(&gpu, "color")?.save(out)
}

#[test]
fn the_image_is_written() {
    let out = std::env::temp_dir().join(format!("lightgraph-headless-{}.png", std::process::id()));
    draw(&out).unwrap_or_else(|f| panic!("{f}"));
    let image = image::open(&out).unwrap().to_rgb8();
    assert_eq!(image.dimensions(), (96, 96));
    // Light everywhere in the box, which ends five pixels before the image does, and the red wall redder than green.
    let inside = |x: u32, y: u32| (6..90).contains(&x) && (6..90).contains(&y);
    assert!(image.enumerate_pixels().all(|(x, y, p)| !inside(x, y) || p[0].max(p[1]).max(p[2]) > 8));
    assert!(image.get_pixel(8, 48)[0] > 2 * image.get_pixel(8, 48)[1]);
    std::fs::remove_file(out).unwrap();
}
