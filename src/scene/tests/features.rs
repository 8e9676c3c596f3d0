//! One small file for each feature of glTF and for each misuse, with what must come of it: values of the scene, a
//! notice, or a fault with its place.

mod materials;
mod textures;
mod vertices;

use super::fixture::Fixture;
use crate::{diag::render, scene::Scene};
use serde_json::{Value, json};

/// What a file must come to.
enum Outcome {
    /// A scene that passes, without a word.
    Silent(fn(&Scene) -> bool),
    /// A scene that passes, and all these words among its notices.
    Notice(&'static [&'static str], fn(&Scene) -> bool),
    /// All these words among its faults.
    Fault(&'static [&'static str]),
}

use Outcome::{Fault, Notice, Silent};

type Case = (&'static str, fn(&mut Fixture), Outcome);

fn material(f: &mut Fixture) -> &mut Value {
    &mut f.json["materials"][0]
}

fn attribute(f: &mut Fixture, name: &str, accessor: usize) {
    f.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
}

/// A PNG of two by two texels.
fn png(texels: [[u8; 4]; 4]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(vec![]);
    let image = image::RgbaImage::from_fn(2, 2, |x, y| image::Rgba(texels[(2 * y + x) as usize]));
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

const RED: [[u8; 4]; 4] = [[255, 0, 0, 255]; 4];

/// Adds a texture of these texels, and coordinates for it; its reference.
fn texture(f: &mut Fixture, texels: [[u8; 4]; 4]) -> Value {
    let view = f.view(&png(texels));
    for key in ["images", "textures", "samplers"] {
        if f.json.get(key).is_none() {
            f.json[key] = json!([]);
        }
    }
    let image = f.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    let index = f.push("textures", json!({"source": image}));
    let uv = f.floats(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    attribute(f, "TEXCOORD_0", uv);
    json!({"index": index})
}

fn base_texture(f: &mut Fixture, texels: [[u8; 4]; 4]) {
    let texture = texture(f, texels);
    material(f)["pbrMetallicRoughness"] = json!({"baseColorTexture": texture, "metallicFactor": 0});
}

fn sampler(f: &mut Fixture, sampler: Value) {
    base_texture(f, RED);
    f.push("samplers", sampler);
    f.json["textures"][0]["sampler"] = json!(0);
}

fn transformed(f: &mut Fixture, transform: Value) {
    base_texture(f, RED);
    material(f)["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = json!({"KHR_texture_transform": transform});
}

fn extension(f: &mut Fixture, name: &str, value: Value) {
    material(f)["extensions"] = json!({name: value});
}

/// An accessor over bytes of any kind.
fn accessor(f: &mut Fixture, bytes: &[u8], kind: u32, shape: &str, count: usize, normalized: bool) -> usize {
    let view = f.view(bytes);
    let value =
        json!({"bufferView": view, "componentType": kind, "count": count, "type": shape, "normalized": normalized});
    f.push("accessors", value)
}

/// The first material's row of `maps` for its base colour.
fn map(scene: &Scene) -> &crate::scene::MaterialTexture {
    &scene.maps[scene.materials[0].base_color_texture.unwrap() as usize]
}

/// The first texel of a texture.
fn texel(scene: &Scene, row: Option<u32>) -> [u8; 4] {
    let (map, pages) = (&scene.maps[row.unwrap() as usize], scene.textures.as_ref().unwrap());
    let place = (map.layer * pages.height + map.corner[1]) * pages.width + map.corner[0];
    pages.mips[0].as_chunks::<4>().0[place as usize]
}

fn any(_: &Scene) -> bool {
    true
}

/// Those who speak of light and of cameras are not meant.
fn spoken(text: &str) -> Vec<&str> {
    let others = ["no light", "sun", "camera", "reflects all light"];
    text.split("\n\n").filter(|d| !d.trim().is_empty() && !others.iter().any(|o| d.contains(o))).collect()
}

fn hold(cases: &[Case]) {
    let mut wrong = vec![];
    for (name, build, outcome) in cases {
        let mut f = Fixture::quad();
        build(&mut f);
        match (f.read(), outcome) {
            (Ok((scene, notices)), Silent(test)) => {
                let text = render(&notices);
                if !spoken(&text).is_empty() || !test(&scene) {
                    wrong.push(format!("{name}: {text}"));
                }
            }
            (Ok((scene, notices)), Notice(words, test)) => {
                let text = render(&notices);
                if !words.iter().all(|w| text.contains(w)) || !test(&scene) {
                    wrong.push(format!("{name}: {text}"));
                }
            }
            (Err(text), Fault(words)) if words.iter().all(|w| text.contains(w)) => {}
            (Ok(_), Fault(_)) => wrong.push(format!("{name}: no fault")),
            (Err(text), _) => wrong.push(format!("{name}: {text}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn materials_come_to_what_they_state() {
    hold(materials::MATERIALS);
}

#[test]
fn textures_come_to_what_they_state() {
    hold(textures::TEXTURES);
}

#[test]
fn vertices_come_to_what_they_state() {
    hold(vertices::VERTICES);
}

#[test]
fn what_is_unlit_or_lets_light_through_does_not_reflect_all_of_it() {
    let notes = |name: &str, value: Value| {
        let mut f = Fixture::quad();
        if !name.is_empty() {
            extension(&mut f, name, value);
        }
        render(&f.read().unwrap_or_else(|e| panic!("{e}")).1)
    };
    assert!(notes("", Value::Null).contains("\"white\" reflects all light"));
    for (name, value) in
        [("KHR_materials_unlit", json!({})), ("KHR_materials_transmission", json!({"transmissionFactor": 0.5}))]
    {
        assert!(!notes(name, value).contains("reflects all light"), "{name}");
    }
}

#[test]
fn there_is_a_file_for_each_of_sixty_features_and_misuses() {
    let count = materials::MATERIALS.len() + textures::TEXTURES.len() + vertices::VERTICES.len();
    assert!(count >= 60, "{count}");
}
