//! Composition and reflection from text to interface; every fault with its place.

mod faults;
mod joining;
mod probe;
mod reflection;

use super::*;
use crate::{
    diag::{Source, render},
    value::Type,
};

fn library(files: &[(&str, &str)]) -> Library {
    let files = files.iter().map(|(path, text)| ((*path).to_owned(), Source::new(*path, *text)));
    Library { files: files.collect(), ..Library::default() }
}

fn defs(list: &[(&str, Def)]) -> Defs {
    list.iter().map(|(name, def)| ((*name).to_owned(), *def)).collect()
}

/// The shader `main.wgsl` among `files`; fails with the faults as shown to a user.
fn composed(files: &[(&str, &str)], definitions: &[(&str, Def)]) -> Shader {
    match compose(&library(files), "main.wgsl", &defs(definitions), &[]) {
        Ok(shader) => shader,
        Err(faults) => panic!("{faults}"),
    }
}

fn interface(text: &str) -> Interface {
    composed(&[("main.wgsl", text)], &[]).interface
}

/// Composing `main.wgsl` shows each of `expected`.
fn check_files(files: &[(&str, &str)], definitions: &[(&str, Def)], expected: &[&str]) {
    let shown = match compose(&library(files), "main.wgsl", &defs(definitions), &[]) {
        Ok(_) => panic!("no fault"),
        Err(faults) => {
            assert!(faults.0.iter().all(|d| !d.labels.is_empty()), "a fault without a place: {faults}");
            render(&faults.0)
        }
    };
    for text in expected {
        assert!(shown.contains(text), "expected `{text}` in:\n{shown}");
    }
    for mark in ["X_naga_oil", "X_member", "NUYA"] {
        assert!(!shown.contains(mark), "decorated names:\n{shown}");
    }
}

fn check(text: &str, expected: &[&str]) {
    check_files(&[("main.wgsl", text)], &[], expected);
}

fn names(interface: &Interface) -> Vec<&str> {
    interface.variables.iter().map(|v| v.name.as_str()).collect()
}

const SCENE: &str = "#define_import_path scene
struct Material { base_color: vec4f, c1: vec3f, shininess: f32 }
struct Unused { m: mat3x3f }
var<storage, read> materials: array<Material>;
var<uniform> spare: Unused;
fn shine(i: u32) -> f32 { return materials[i].shininess * materials[i].c1.x; }
";

#[test]
fn a_shader_is_composed_once_for_the_same_texts() {
    let text = |factor: &str, comment: &str| {
        let part = format!("#define_import_path part\n{comment}\nfn twice(x: f32) -> f32 {{ return x * {factor}; }}");
        let main = "#import part::twice\nvar<storage, read_write> out: array<f32>;
            @compute @workgroup_size(1) fn main() { out[0] = twice(out[1]); }";
        library(&[("main.wgsl", main), ("part.wgsl", &part), ("other.wgsl", "fn f() {}")])
    };
    let shader = |library: &Library| library.shader("main.wgsl", &Defs::new(), &[]).unwrap_or_else(|f| panic!("{f}"));
    let first = text("2.0", "");
    let made = shader(&first);
    assert!(std::sync::Arc::ptr_eq(&made, &shader(&first.clone())));
    // Read again, the texts are other allocations.
    let again = text("2.0", "").after(&first);
    assert!(std::sync::Arc::ptr_eq(&made, &shader(&again)));
    let commented = shader(&text("2.0", "// Doubles.").after(&first));
    assert!(!std::sync::Arc::ptr_eq(&made, &commented), "its places have moved");
    assert_eq!(made.content, commented.content, "but it computes the same");
    let changed = shader(&text("3.0", "").after(&again));
    assert_ne!(made.content, changed.content);
    // A second file of the same name is a fault, though neither text of the first two has changed.
    let mut twins = again.clone();
    twins.files.insert("twin.wgsl".into(), Source::new("twin.wgsl", "#define_import_path part\n"));
    twins.shader("main.wgsl", &Defs::new(), &[]).expect_err("two files called `part`");
}
