//! Facts and tables of small rooms like those that renderers are compared on: an open box with a point light, a closed
//! room with a spot, and the same room with an emissive rectangle.

use super::fixture::Fixture;
use crate::{
    scene::{FACTS, Scene, TABLES, Table, TableKind},
    value::{Value, Values},
};
use glam::{Vec3, Vec4};
use serde_json::json;
use std::f32::consts::{PI, TAU};

/// A box from (−1, 0, −1) to (1, 2, 1) that faces inward; the wall at +Z may be left out.
fn room(closed: bool) -> Fixture {
    let mut f = Fixture::new();
    let pbr = |c: [f32; 4]| json!({"baseColorFactor": c, "metallicFactor": 0});
    let white = f.material(json!({"name": "white", "pbrMetallicRoughness": pbr([0.73, 0.73, 0.73, 1.0])}));
    let red = f.material(json!({"name": "red", "pbrMetallicRoughness": pbr([0.63, 0.065, 0.05, 1.0])}));
    let green = f.material(json!({"name": "green", "pbrMetallicRoughness": pbr([0.14, 0.45, 0.091, 1.0])}));
    let corner = |i: usize| {
        let pick = |bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
        [pick(1, -1.0, 1.0), pick(2, 0.0, 2.0), pick(4, -1.0, 1.0)]
    };
    let walls = [
        ("floor", [4, 5, 1, 0], white),
        ("ceiling", [2, 3, 7, 6], white),
        ("back", [0, 1, 3, 2], white),
        ("left", [4, 0, 2, 6], red),
        ("right", [1, 5, 7, 3], green),
        ("front", [5, 4, 6, 7], white),
    ];
    for (name, corners, material) in walls {
        if closed || name != "front" {
            f.wall(name, corners.map(corner), material);
        }
    }
    f
}

fn point_room() -> Scene {
    let mut f = room(false);
    let light = json!({"name": "lamp", "type": "point", "intensity": 6.0});
    f.light(json!({"name": "lamp", "translation": [0, 1.6, 0.1]}), light);
    f.scene()
}

fn spot_room() -> Scene {
    let mut f = room(true);
    let cone = json!({"innerConeAngle": 0.5995, "outerConeAngle": 0.6});
    let light = json!({"type": "spot", "intensity": 8.0, "color": [1, 0.5, 0.25], "range": 20, "spot": cone});
    let half = std::f32::consts::FRAC_1_SQRT_2;
    f.light(json!({"name": "lamp", "translation": [0, 1.95, 0.1], "rotation": [-half, 0, 0, half]}), light);
    f.scene()
}

fn area_room() -> Scene {
    let mut f = room(true);
    let lamp = f.material(json!({
        "name": "lamp",
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
        "emissiveFactor": [1.0, 0.5, 0.25],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 12.0}},
    }));
    let corners = [[-0.2, 1.99, -0.1], [0.2, 1.99, -0.1], [0.2, 1.99, 0.1], [-0.2, 1.99, 0.1]];
    f.wall("lamp", corners, lamp);
    f.scene()
}

fn facts_of(scene: &Scene) -> Values {
    let facts = scene.facts();
    let mut named: Vec<(&str, crate::value::Type)> = facts.iter().map(|(k, v)| (k.as_str(), v.ty())).collect();
    let mut stated = FACTS.to_vec();
    named.sort_unstable();
    stated.sort_unstable();
    assert_eq!(named, stated);
    facts
}

fn expect(facts: &Values, expected: &[(&str, u32)]) {
    for (name, value) in expected {
        assert_eq!(facts[*name], Value::Uint(*value), "{name}");
    }
}

fn tables_of(scene: &Scene) -> Vec<Table> {
    let tables = scene.tables(&scene.pose(0.0));
    assert_eq!(tables.len(), TABLES.len());
    for (table, TableKind { name, columns, .. }) in tables.iter().zip(TABLES) {
        assert_eq!(table.name, *name);
        let named: Vec<&str> = table.columns.iter().map(|c| c.0).collect();
        let stated: Vec<&str> = columns.iter().map(|c| c.0).collect();
        assert_eq!(named, stated, "{name}");
        for ((column, values), (_, ty)) in table.columns.iter().zip(*columns) {
            assert!(values.get(table.rows).is_none(), "{name}.{column} is too long");
            for row in 0..table.rows {
                assert_eq!(values.get(row).map(|v| v.ty()), Some(*ty), "{name}.{column}[{row}]");
            }
        }
    }
    tables
}

fn cell(tables: &[Table], table: &str, column: &str, row: usize) -> Value {
    let table = tables.iter().find(|t| t.name == table).unwrap();
    table.column(column).unwrap().get(row).unwrap()
}

fn float(value: Value) -> f32 {
    match value {
        Value::Float(v) => v,
        other => panic!("{other:?}"),
    }
}

fn vec3(value: Value) -> Vec3 {
    match value {
        Value::Vec3(v) => v,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_open_box_with_a_point_light() {
    let scene = point_room();
    let facts = facts_of(&scene);
    expect(&facts, &[("lights", 1), ("point_lights", 1), ("spot_lights", 0), ("light_views", 6), ("emitters", 0)]);
    expect(&facts, &[("materials", 3), ("nodes", 6), ("moving_nodes", 0), ("triangles", 10), ("vertices", 30)]);
    assert_eq!(facts["bounds_min"], Value::Vec3(Vec3::new(-1.0, 0.0, -1.0)));
    assert_eq!(facts["grid_max"], Value::Vec3(Vec3::new(1.0, 2.0, 1.0)));
    let tables = tables_of(&scene);
    assert_eq!(cell(&tables, "lights", "kind", 0), Value::Uint(0));
    assert_eq!(cell(&tables, "lights", "position", 0), Value::Vec3(Vec3::new(0.0, 1.6, 0.1)));
    assert_eq!(cell(&tables, "lights", "intensity", 0), Value::Vec3(Vec3::splat(6.0)));
    assert_eq!(cell(&tables, "lights", "views", 0), Value::Uint(6));
    assert_eq!(cell(&tables, "materials", "base_color", 1), Value::Vec4(Vec4::new(0.63, 0.065, 0.05, 1.0)));
    assert_eq!(cell(&tables, "materials", "base_color_texture", 1), Value::Uint(u32::MAX));
    for row in 0..6 {
        assert_eq!(cell(&tables, "light_views", "light", row), Value::Uint(0));
    }
}

#[test]
fn every_wall_faces_the_middle_of_the_room() {
    let tables = tables_of(&spot_room());
    for row in 0..12 {
        let at = |column| vec3(cell(&tables, "triangles", column, row));
        let (a, b, c, normal) = (at("a"), at("b"), at("c"), at("na"));
        assert!((b - a).cross(c - a).normalize().distance(normal) < 1e-5, "triangle {row}");
        assert!(normal.dot(Vec3::Y - a) > 0.0, "triangle {row}");
    }
}

#[test]
fn a_closed_room_with_a_spot() {
    let scene = spot_room();
    let facts = facts_of(&scene);
    expect(&facts, &[("lights", 1), ("point_lights", 0), ("spot_lights", 1), ("light_views", 1), ("triangles", 12)]);
    let tables = tables_of(&scene);
    assert_eq!(cell(&tables, "lights", "kind", 0), Value::Uint(1));
    assert!(vec3(cell(&tables, "lights", "direction", 0)).distance(Vec3::NEG_Y) < 1e-6);
    assert_eq!(cell(&tables, "lights", "intensity", 0), Value::Vec3(Vec3::new(8.0, 4.0, 2.0)));
    assert_eq!(cell(&tables, "lights", "range", 0), Value::Float(20.0));
    assert!((float(cell(&tables, "lights", "cos_outer", 0)) - 0.6_f32.cos()).abs() < 1e-6);
    assert!((float(cell(&tables, "lights", "cos_inner", 0)) - 0.5995_f32.cos()).abs() < 1e-6);
}

#[test]
fn a_closed_room_with_an_emissive_rectangle() {
    let scene = area_room();
    let facts = facts_of(&scene);
    expect(&facts, &[("lights", 0), ("light_views", 0), ("emitters", 2), ("emissive_materials", 1), ("materials", 4)]);
    let tables = tables_of(&scene);
    assert_eq!(cell(&tables, "materials", "emission", 3), Value::Vec3(Vec3::new(12.0, 6.0, 3.0)));
    let area: f32 = (0..2).map(|row| float(cell(&tables, "emitters", "area", row))).sum();
    assert!((area - 0.08).abs() < 1e-6, "{area}");
    assert_eq!(cell(&tables, "emitters", "radiance", 1), Value::Vec3(Vec3::new(12.0, 6.0, 3.0)));
    let (a, b, c) = ("a", "b", "c");
    let [a, b, c] = [a, b, c].map(|column| vec3(cell(&tables, "emitters", column, 0)));
    assert!((b - a).cross(c - a).normalize().distance(Vec3::NEG_Y) < 1e-5, "the lamp shines down");
}

#[test]
fn lights_know_their_rows_of_views() {
    let mut f = room(true);
    f.light(json!({"name": "sun"}), json!({"type": "directional", "intensity": 3}));
    f.light(json!({"name": "bulb"}), json!({"type": "point"}));
    let cone = json!({"outerConeAngle": 0.5});
    f.light(json!({"name": "torch"}), json!({"type": "spot", "spot": cone}));
    let scene = f.scene();
    expect(&facts_of(&scene), &[("lights", 3), ("directional_lights", 1), ("light_views", 8)]);
    let tables = tables_of(&scene);
    let first: Vec<Value> = (0..3).map(|row| cell(&tables, "lights", "first_view", row)).collect();
    assert_eq!(first, [Value::Uint(0), Value::Uint(1), Value::Uint(7)]);
    let owner: Vec<Value> = (0..8).map(|row| cell(&tables, "light_views", "light", row)).collect();
    assert_eq!(owner, [0, 1, 1, 1, 1, 1, 1, 2].map(Value::Uint));
    assert_eq!(cell(&tables, "lights", "kind", 0), Value::Uint(2));
}

#[test]
fn a_scene_file_adds_its_grid_finish_and_camera() {
    let mut f = room(true);
    for name in ["first", "second"] {
        let lens = json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}});
        let camera = f.push("cameras", lens);
        f.node(json!({"name": name, "camera": camera}));
    }
    let scene = f
        .described(
            r#"Scene(
                grid: ((-0.5, 0, -0.5), (0.5, 1, 0.5)),
                materials: {"white": (specular: 0.4, shininess: 20)},
                motion: {"back": [(time: 0), (time: 1, translation: (0, 0, -2))]},
                camera: "second",
            )"#,
        )
        .unwrap();
    let facts = facts_of(&scene);
    expect(&facts, &[("specular_materials", 1), ("moving_nodes", 1)]);
    assert_eq!(facts["grid_min"], Value::Vec3(Vec3::new(-0.5, 0.0, -0.5)));
    assert_eq!(facts["bounds_min"], Value::Vec3(Vec3::new(-1.0, 0.0, -3.0)));
    assert_eq!(scene.default_camera, Some(1));
    let tables = tables_of(&scene);
    assert_eq!(cell(&tables, "materials", "specular", 0), Value::Float(0.4));
    assert_eq!(cell(&tables, "materials", "shininess", 0), Value::Float(20.0));
    assert_eq!(cell(&tables, "materials", "specular", 1), Value::Float(0.0));
}

#[test]
fn the_same_bytes_give_the_same_scene_and_tables() {
    let (a, b) = (spot_room(), spot_room());
    assert_eq!(a, b);
    assert_eq!(a.tables(&a.pose(0.5)), b.tables(&b.pose(0.5)));
}

/// A ball of one metre, whose faces look inwards, alone.
fn bubble() -> Fixture {
    let mut f = Fixture::new();
    let n: u16 = 12;
    let place = |i: u16, k: u16| {
        let (down, turn) = (f32::from(i) * PI / f32::from(n), f32::from(k) * TAU / f32::from(n));
        let out = 0.5 * down.sin().max(0.0);
        [out * turn.cos(), 0.5 * down.cos(), out * turn.sin()]
    };
    let places: Vec<[f32; 3]> = (0..=n).flat_map(|i| (0..n).map(move |k| place(i, k))).collect();
    let square = |i: u16, k: u16| {
        let (a, b, c, d) = (i * n + k, i * n + (k + 1) % n, (i + 1) * n + k, (i + 1) * n + (k + 1) % n);
        [a, c, b, b, c, d]
    };
    let indices: Vec<u16> = (0..n).flat_map(|i| (0..n).flat_map(move |k| square(i, k))).collect();
    let (position, indices) = (f.floats(&places), f.shorts(&indices));
    f.material(json!({"name": "white"}));
    f.mesh(json!({"attributes": {"POSITION": position}, "indices": indices, "material": 0}));
    f.node(json!({"name": "bubble", "mesh": 0}));
    f
}

#[test]
fn a_thing_that_is_inside_out_is_turned_round_and_a_small_room_is_not() {
    let turned = |f: &Fixture| {
        let (scene, notices) = f.completed();
        (scene, crate::diag::render(&notices).contains("inside out"))
    };
    let (scene, said) = turned(&bubble());
    assert!(said && scene.cameras.is_empty());
    let outwards = scene.geometry.indices.chunks_exact(3).all(|t| {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(scene.geometry.vertices[t[i] as usize].position));
        (b - a).cross(c - a).dot(a + b + c) > 0.0
    });
    assert!(outwards);
    let (scene, said) = turned(&room(true));
    assert!(!said && scene.cameras[0].name == "inside");
}

#[test]
fn what_glows_a_little_in_the_open_is_no_light_and_a_lamp_in_a_room_is() {
    let glowing = |mut f: Fixture, radiance: f32| {
        let label = f.material(json!({"name": "label", "emissiveFactor": [radiance, radiance, radiance]}));
        f.wall("label", [[0.0, 1.0, 0.0], [0.2, 1.0, 0.0], [0.2, 1.2, 0.0], [0.0, 1.2, 0.0]], label);
        let (scene, notices) = f.completed();
        assert_eq!(crate::diag::render(&notices).contains("no light but the faint glow"), !scene.lights.is_empty());
        scene.lights.len()
    };
    let yard = || {
        let mut f = Fixture::new();
        let ground = f.material(json!({"name": "ground"}));
        f.wall("ground", [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]], ground);
        f
    };
    // A lamp in a room, a label in the sun, a lamp in the night.
    assert_eq!([glowing(room(true), 1.0), glowing(yard(), 1.0), glowing(yard(), 20.0)], [0, 1, 0]);
}
