//! Composition and reflection from text to interface; every fault with its place.

mod faults;
mod joining;
mod reflection;

use super::*;
use crate::{
    diag::{Source, render},
    value::Type,
};

fn library(files: &[(&str, &str)]) -> Library {
    let files = files.iter().map(|(path, text)| ((*path).to_owned(), Source::new(*path, *text)));
    Library { files: files.collect() }
}

fn defs(list: &[(&str, Def)]) -> Defs {
    list.iter().map(|(name, def)| ((*name).to_owned(), *def)).collect()
}

/// The shader `main.wgsl` among `files`; fails with the faults as shown to a user.
fn composed(files: &[(&str, &str)], definitions: &[(&str, Def)]) -> Shader {
    match compose(&library(files), "main.wgsl", &defs(definitions)) {
        Ok(shader) => shader,
        Err(faults) => panic!("{faults}"),
    }
}

fn interface(text: &str) -> Interface {
    composed(&[("main.wgsl", text)], &[]).interface
}

/// Composing `main.wgsl` shows each of `expected`.
fn check_files(files: &[(&str, &str)], definitions: &[(&str, Def)], expected: &[&str]) {
    let shown = match compose(&library(files), "main.wgsl", &defs(definitions)) {
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
