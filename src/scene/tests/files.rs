//! From paths to scenes, through real files.

use super::fixture::Fixture;
use crate::{
    diag::render,
    scene::{Loaded, Scene},
};
use serde_json::json;
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A directory of its own for one test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("lightgraph-scene-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, bytes).unwrap();
        path
    }

    fn load(&self, name: &str) -> Result<Loaded, String> {
        Scene::load(&self.0.join(name)).map_err(|faults| render(&faults.0))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder left behind harms nobody, and a panic here would hide the test's own.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn names(files: &[PathBuf]) -> Vec<&str> {
    files.iter().filter_map(|f| f.file_name()?.to_str()).collect()
}

const GRID: &str = "grid: ((0, 0, 0), (1, 1, 1))";

#[test]
fn a_path_may_leave_its_ending_out() {
    let folder = Folder::new("endings");
    folder.write("a.glb", Fixture::quad().glb());
    folder.write("b/b.glb", Fixture::quad().glb());
    folder.write("c.v2.glb", Fixture::quad().glb());
    folder.write("d.glb", Fixture::quad().glb());
    folder.write("d.ron", format!("Scene({GRID})"));
    for (path, read) in [
        ("a", vec!["a.glb"]),
        ("a.glb", vec!["a.glb"]),
        ("b", vec!["b.glb"]),
        ("c.v2", vec!["c.v2.glb"]),
        ("d", vec!["d.ron", "d.glb"]),
        ("d.ron", vec!["d.ron", "d.glb"]),
        ("d.glb", vec!["d.ron", "d.glb"]),
    ] {
        let loaded = folder.load(path).unwrap();
        assert_eq!(names(&loaded.files), read, "{path}");
        assert_eq!(loaded.scene.grid != loaded.scene.bounds, path.starts_with('d'), "{path}");
    }
    assert_eq!(folder.load("d").unwrap().scene.name, "d");
    assert_eq!(folder.load("c.v2").unwrap().scene.name, "c.v2");
}

#[test]
fn a_scene_that_is_not_there_names_what_was_looked_for_and_the_nearest() {
    let folder = Folder::new("missing");
    folder.write("hall.glb", Fixture::quad().glb());
    let text = folder.load("hal").unwrap_err();
    for expected in ["there is no scene", "did you mean `hall`?", "hal.ron", "hal.glb"] {
        assert!(text.contains(expected), "no {expected:?} in\n{text}");
    }
    for path in ["gone.glb", "gone.ron", "gone/gone.gltf"] {
        assert!(folder.load(path).unwrap_err().contains("can't read"), "{path}");
    }
    assert!(Scene::load(Path::new("")).is_err());
    assert!(Scene::load(Path::new("/")).is_err());
}

#[test]
fn a_scene_file_names_its_gltf() {
    let folder = Folder::new("names");
    folder.write("models/hall.glb", Fixture::quad().glb());
    folder.write("day.ron", format!("Scene(gltf: \"models/hall.glb\", {GRID})"));
    let loaded = folder.load("day").unwrap();
    assert_eq!((names(&loaded.files), loaded.scene.name.as_str()), (vec!["day.ron", "hall.glb"], "day"));
    folder.write("night.ron", "Scene(gltf: \"models/hal.glb\")");
    let text = folder.load("night").unwrap_err();
    assert!(text.contains("night.ron:1:13") && text.contains("is no glTF file that is there"), "{text}");
    folder.write("alone.ron", "Scene()");
    assert!(folder.load("alone").unwrap_err().contains("names no glTF"));
    // What can't be read of the file is told, not that it names nothing.
    for (text, fault) in [("Scene(gtlf: \"models/hall.glb\")", "gtlf"), ("Scene(gltf: 3)", "alone.ron:1:")] {
        folder.write("alone.ron", text);
        let told = folder.load("alone").unwrap_err();
        assert!(told.contains(fault) && !told.contains("names no glTF"), "{told}");
    }
    // A scene file of the same stem that is about another glTF is left alone, aloud.
    folder.write("day.glb", Fixture::quad().glb());
    let loaded = folder.load("day.glb").unwrap();
    assert_eq!(loaded.scene.grid, loaded.scene.bounds);
    assert!(render(&loaded.notices).contains("describes another glTF and is not used"));
}

#[test]
fn a_gltf_reads_its_buffer_and_images_from_files_or_data() {
    let folder = Folder::new("buffers");
    let mut f = Fixture::quad();
    let uv = f.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    f.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    f.json["images"] = json!([{"uri": "tex/red%20wood.png"}]);
    f.json["textures"] = json!([{"source": 0}]);
    f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    let png = folder.write("tex/red wood.png", []);
    image::RgbImage::from_pixel(4, 2, image::Rgb([9, 8, 7])).save(&png).unwrap();
    f.json["buffers"] = json!([{"byteLength": f.bytes.len(), "uri": "quad.bin"}]);
    folder.write("quad.bin", &f.bytes);
    folder.write("quad.gltf", f.json.to_string());
    let loaded = folder.load("quad").unwrap();
    assert_eq!(names(&loaded.files), ["quad.gltf", "quad.bin", "red wood.png"]);
    let textures = loaded.scene.textures.as_ref().unwrap();
    assert_eq!((loaded.scene.maps[0].size, &textures.mips[0][..4]), ([4, 2], &[9, 8, 7, 255][..]));

    f.json["buffers"] = json!([{"byteLength": f.bytes.len(), "uri": data_uri(&f.bytes)}]);
    folder.write("inline.gltf", f.json.to_string());
    assert_eq!(folder.load("inline").unwrap().scene.geometry, loaded.scene.geometry);

    fs::remove_file(&png).unwrap();
    let loaded = folder.load("quad").unwrap();
    let text = render(&loaded.notices);
    assert!(text.contains("images[0]: can't read") && text.contains("red wood.png"), "{text}");
    assert!(text.contains("a magenta checker stands for it"), "{text}");
    assert_eq!(loaded.scene.textures.unwrap().mips[0][..8], [255, 0, 255, 255, 0, 0, 0, 255]);
}

#[test]
fn images_that_name_one_file_are_decoded_once() {
    let folder = Folder::new("one-image");
    let mut f = Fixture::quad();
    let uv = f.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    f.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    f.json["images"] = json!([{"uri": "a.png"}, {"uri": "a.png"}]);
    f.json["textures"] = json!([{"source": 0}, {"source": 1}]);
    f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
    f.material(json!({"name": "same", "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}}));
    let png = folder.write("a.png", []);
    image::RgbImage::from_pixel(2, 2, image::Rgb([9, 8, 7])).save(&png).unwrap();
    folder.write("quad.glb", f.glb());
    let loaded = folder.load("quad").unwrap();
    assert_eq!(names(&loaded.files), ["quad.glb", "a.png"]);
    assert_eq!(loaded.scene.textures.as_ref().unwrap().layers, 1);
    assert_eq!(loaded.scene.materials[1].base_color_texture, Some(0));
}

#[test]
fn a_scene_names_no_file_outside_of_its_folder() {
    let folder = Folder::new("outside");
    let mut f = Fixture::quad();
    folder.write("other/quad.bin", &f.bytes);
    folder.write("other/quad.glb", f.glb());
    folder.write("other/sky.hdr", "");
    let absolute = folder.0.join("other/quad.bin").display().to_string();
    for uri in ["../other/quad.bin", "%2e%2e/other/quad.bin", &absolute] {
        f.json["buffers"] = json!([{"byteLength": f.bytes.len(), "uri": uri}]);
        folder.write("scene/quad.gltf", f.json.to_string());
        let text = folder.load("scene/quad.gltf").unwrap_err();
        assert!(text.contains("leads out of the folder"), "{uri}: {text}");
    }
    folder.write("scene/far.ron", "Scene(gltf: \"../other/quad.glb\")");
    let text = folder.load("scene/far.ron").unwrap_err();
    assert!(text.contains("far.ron:1:13") && text.contains("leads out of the folder"), "{text}");
    folder.write("scene/sky.glb", Fixture::quad().glb());
    folder.write("scene/sky.ron", "Scene(environment: File(file: \"../other/sky.hdr\"))");
    let text = folder.load("scene/sky").unwrap_err();
    assert!(text.contains("sky.ron:1:") && text.contains("leads out of the folder"), "{text}");
}

#[test]
fn faults_of_the_scene_file_and_the_gltf_come_together() {
    let folder = Folder::new("together");
    let mut f = Fixture::quad();
    f.json["materials"][0]["emissiveFactor"] = json!([-1, 0, 0]);
    folder.write("both.glb", f.glb());
    folder.write("both.ron", "Scene(\n  grid: ((0, 0, 0), (0, 1, 1)),\n  camera: \"eye\",\n)");
    let text = folder.load("both").unwrap_err();
    for expected in ["both.ron:2:9", "both.ron:3:11", "emission"] {
        assert!(text.contains(expected), "no {expected:?} in\n{text}");
    }
}

fn data_uri(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:application/octet-stream;base64,");
    for group in bytes.chunks(3) {
        let word = group.iter().fold(0_u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - group.len()));
        for digit in 0..4 {
            let value = word >> (18 - 6 * digit) & 63;
            text.push(if digit <= group.len() { char::from(DIGITS[value as usize]) } else { '=' });
        }
    }
    text
}
