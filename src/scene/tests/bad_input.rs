//! Malformed files: each gives its fault, and none a panic.

use super::fixture::{Fixture, QUAD, QUAD_INDICES, read_bytes};
use crate::scene::Scene;
use serde_json::json;

/// The faults of a changed quad must hold all these words.
fn check(change: impl FnOnce(&mut Fixture), words: &[&str]) {
    let mut f = Fixture::quad();
    change(&mut f);
    expect(&f.faults(), words);
}

fn expect(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "no {word:?} in\n{text}");
    }
}

#[test]
fn a_glb_cut_off_anywhere_is_a_fault() {
    let whole = Fixture::quad().glb();
    assert!(read_bytes(&whole).is_ok());
    for length in 0..whole.len() {
        let text = read_bytes(&whole[..length]).expect_err("a part of a file passed for the whole");
        assert!(text.starts_with("error: test.glb: "), "{text}");
    }
    expect(&read_bytes(&whole[..40]).unwrap_err(), &["the GLB is cut off", "but has 40"]);
}

#[test]
fn what_is_no_gltf_is_said_to_be_none() {
    expect(&read_bytes(b"\x89PNG....").unwrap_err(), &["neither a GLB", "nor glTF JSON"]);
    expect(&read_bytes(b"").unwrap_err(), &["the file is empty"]);
    expect(&read_bytes(b"{\n  \"asset\": 3\n}").unwrap_err(), &["not valid glTF JSON", "test.glb:2:"]);
    let deep = "{\"asset\":".to_owned() + &"[".repeat(100_000);
    expect(&read_bytes(deep.as_bytes()).unwrap_err(), &["not valid glTF JSON"]);
    // Lengths below the header's own, and chunks that claim more than there is.
    let mut glb = Fixture::quad().glb();
    for length in [0_u32, 5, 12, 19] {
        glb[8..12].copy_from_slice(&length.to_le_bytes());
        assert!(read_bytes(&glb).is_err());
    }
    let mut glb = Fixture::quad().glb();
    glb[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    expect(&read_bytes(&glb).unwrap_err(), &["no whole JSON chunk"]);
    let mut glb = Fixture::quad().glb();
    glb[4] = 1;
    expect(&read_bytes(&glb).unwrap_err(), &["GLB version 1"]);
}

#[test]
fn every_flipped_byte_of_a_glb_is_survived() {
    let whole = Fixture::quad().glb();
    for i in 0..whole.len() {
        for flip in [0x01, 0x10, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[i] ^= flip;
            // Some flips make another sound file; what counts is that none panics.
            let _ = read_bytes(&bytes);
        }
    }
}

#[test]
fn positions_that_are_no_numbers_are_faults() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        let change = |f: &mut Fixture| {
            let mut corners = QUAD;
            corners[2][1] = bad;
            let position = f.floats(&corners);
            f.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(position);
        };
        check(change, &["meshes[0] \"mesh\" primitive 0: POSITION of vertex 2", "no usable vector"]);
    }
}

#[test]
fn accessors_are_checked_before_they_are_read() {
    let accessor = |i: usize, key: &'static str, value: serde_json::Value| {
        move |f: &mut Fixture| f.json["accessors"][i][key] = value
    };
    check(accessor(0, "count", json!(5)), &["accessor 0 of 5 elements reaches past its buffer view of 48 bytes"]);
    check(accessor(0, "count", json!(u64::MAX)), &["reaches past its buffer view"]);
    check(accessor(0, "byteOffset", json!(4)), &["reaches past"]);
    check(accessor(0, "byteOffset", json!(u64::MAX)), &["reaches past"]);
    check(accessor(0, "bufferView", json!(77)), &["there is no buffer view 77"]);
    check(accessor(0, "type", json!("VEC2")), &["accessor 0 holds Vec2, not Vec3"]);
    check(accessor(0, "componentType", json!(5125)), &["accessor 0 holds U32, not f32"]);
    check(accessor(0, "componentType", json!(1)), &["unknown component type"]);
    check(accessor(0, "type", json!("VEC9")), &["unknown type"]);
    check(accessor(1, "componentType", json!(5126)), &["indices: "]);
    let sparse = |offset: u32, count: u32| {
        let indices = json!({"bufferView": 0, "byteOffset": offset, "componentType": 5125});
        accessor(0, "sparse", json!({"count": count, "indices": indices, "values": {"bufferView": 0}}))
    };
    check(sparse(12, 1), &["accessors[0]: sparse index 1065353216 is out of range"]);
    check(sparse(0, 99), &["accessors[0]: its sparse indices reach past their buffer view of 48 bytes"]);
    let bytes = json!({"bufferView": 0, "componentType": 5121});
    let many = json!({"count": 7, "indices": bytes, "values": {"bufferView": 0}});
    check(accessor(1, "sparse", many), &["accessors[1]: it has 7 sparse values for 6 elements"]);
    check(|f| f.json["bufferViews"][0]["byteStride"] = json!(0), &["elements of 12 bytes, 0 bytes apart"]);
    check(|f| f.json["bufferViews"][0]["byteLength"] = json!(1_u64 << 40), &["buffer view 0 reaches past its buffer"]);
    check(|f| f.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX), &["buffer view 0 reaches past its buffer"]);
    check(|f| f.json["bufferViews"][0]["buffer"] = json!(3), &["there is no buffer 3"]);
}

#[test]
fn indices_out_of_range_are_faults() {
    let primitive = |key: &'static str, value: serde_json::Value| {
        move |f: &mut Fixture| f.json["meshes"][0]["primitives"][0][key] = value
    };
    check(
        |f| {
            let mut indices = QUAD_INDICES;
            indices[3] = 4;
            let accessor = f.shorts(&indices);
            f.json["meshes"][0]["primitives"][0]["indices"] = json!(accessor);
        },
        &["index 4 is out of range: it has 4 vertices"],
    );
    check(primitive("indices", json!(9)), &["indices: there is no accessor 9"]);
    check(primitive("attributes", json!({"POSITION": 9})), &["POSITION: there is no accessor 9"]);
    check(primitive("attributes", json!({})), &["it has no POSITION"]);
    check(primitive("attributes", json!({"POSITION": 0, "NORMAL": 1})), &["NORMAL: accessor 1 holds Scalar"]);
    check(primitive("material", json!(9)), &["there is no material 9"]);
    check(primitive("mode", json!(9)), &["unknown primitive mode"]);
    check(|f| f.json["nodes"][0]["mesh"] = json!(9), &["nodes[0] \"quad\": there is no mesh 9"]);
    check(|f| f.json["nodes"][0]["camera"] = json!(9), &["there is no camera 9"]);
    check(|f| f.json["nodes"][0]["children"] = json!([9]), &["there is no node 9"]);
    check(|f| f.json["scene"] = json!(9), &["there is no scene 9"]);
}

#[test]
fn a_scene_without_triangles_is_a_fault() {
    let mut f = Fixture::quad();
    f.json["scenes"][0]["nodes"] = json!([]);
    expect(&f.faults(), &["it has no triangles"]);
    expect(&read_bytes(br#"{"asset": {"version": "2.0"}}"#).unwrap_err(), &["it has no triangles"]);
    let mut points = Fixture::quad();
    points.json["meshes"][0]["primitives"][0]["mode"] = json!(0);
    expect(&points.faults(), &["Points are not drawn", "it has no triangles"]);
}

#[test]
fn a_cyclic_hierarchy_is_a_fault() {
    check(
        |f| {
            f.json["nodes"][0]["children"] = json!([1]);
            f.push("nodes", json!({"name": "child", "children": [0]}));
        },
        &["nodes[0] \"quad\": it has two parents, or is its own ancestor"],
    );
    check(|f| f.json["nodes"][0]["children"] = json!([0]), &["its own ancestor"]);
    check(|f| f.json["scenes"][0]["nodes"] = json!([0, 0]), &["two parents"]);
}

#[test]
fn a_deep_hierarchy_is_no_fault() {
    let mut f = Fixture::quad();
    f.json["nodes"][0]["children"] = json!([1]);
    for i in 1..20_000 {
        f.push("nodes", json!({"children": [i + 1]}));
    }
    f.push("nodes", json!({}));
    assert_eq!(f.scene().nodes.len(), 20_001);
}

#[test]
fn absurd_counts_of_instances_are_a_fault() {
    let mut f = Fixture::quad();
    let many: Vec<u16> = [0, 1, 2].repeat(20_000);
    let indices = f.shorts(&many);
    f.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    for _ in 0..1000 {
        f.node(json!({"mesh": 0}));
    }
    expect(&f.faults(), &["triangles over all nodes; at most"]);
}

#[test]
fn numbers_out_of_range_are_faults() {
    check(|f| f.json["nodes"][0]["translation"] = json!([0, 1e39, 0]), &["number out of range"]);
    check(|f| f.json["nodes"][0]["translation"] = json!([0, 1e20, 0]), &["leaves the range"]);
    check(|f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), &["no unit quaternion"]);
    check(|f| f.json["nodes"][0]["scale"] = json!([1, 1e39, 1]), &["number out of range"]);
    let mut matrix = vec![0.0_f64; 16];
    check(|f| f.json["nodes"][0]["matrix"] = json!(matrix), &["the last row of its matrix"]);
    matrix[3] = 1e39;
    check(|f| f.json["nodes"][0]["matrix"] = json!(matrix), &["number out of range"]);
    let colour = |c: [f64; 4]| {
        move |f: &mut Fixture| {
            f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorFactor": c});
        }
    };
    check(colour([1e39, 0.0, 0.0, 1.0]), &["number out of range"]);
    check(colour([-0.5, 0.0, 0.0, 1.0]), &["must be finite and not negative"]);
    check(|f| f.json["materials"][0]["emissiveFactor"] = json!([0, -1, 0]), &["emission"]);
    let strength = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 1e38}});
    check(
        |f| {
            f.json["materials"][0]["emissiveFactor"] = json!([1000, 0, 0]);
            f.json["materials"][0]["extensions"] = strength;
        },
        &["emission"],
    );
}

#[test]
fn lights_and_cameras_are_checked() {
    let light = |light: serde_json::Value| {
        move |f: &mut Fixture| {
            f.light(json!({"name": "lamp"}), light);
        }
    };
    check(light(json!({"type": "point", "intensity": 1e39})), &["number out of range"]);
    check(light(json!({"type": "point", "color": [-1, 0, 0]})), &["not negative"]);
    check(light(json!({"type": "point", "range": 0})), &["range 0 must be a positive number"]);
    check(light(json!({"type": "lamp"})), &["none of point, spot and directional"]);
    check(light(json!({"type": "spot"})), &["without its cone"]);
    let spot = |inner: f64, outer: f64| {
        light(json!({"type": "spot", "spot": {"innerConeAngle": inner, "outerConeAngle": outer}}))
    };
    check(spot(0.7, 0.6), &["cone angles 0.7 and 0.6 must rise"]);
    check(spot(0.0, 2.0), &["must rise from 0 to π/2"]);
    check(
        |f| {
            let node = json!({"name": "sun", "scale": [0, 0, 0]});
            f.light(node, json!({"type": "directional"}));
        },
        &["no direction"],
    );
    let camera = |camera: serde_json::Value| {
        move |f: &mut Fixture| {
            let index = f.push("cameras", camera);
            f.node(json!({"camera": index}));
        }
    };
    let perspective = |yfov: f64, near: f64, far: f64| {
        camera(json!({"type": "perspective", "perspective": {"yfov": yfov, "znear": near, "zfar": far}}))
    };
    check(perspective(0.0, 0.1, 1.0), &["cameras[0]: yfov 0"]);
    check(perspective(4.0, 0.1, 1.0), &["yfov 4"]);
    check(perspective(1.0, 0.0, 1.0), &["znear 0"]);
    check(perspective(1.0, 2.0, 1.0), &["in this order"]);
    check(perspective(1e39, 0.1, 1.0), &["number out of range"]);
    check(camera(json!({"type": "perspective"})), &["are missing"]);
    check(camera(json!({"type": "wide"})), &["neither perspective nor orthographic"]);
    let ortho = json!({"xmag": 1, "ymag": 0, "znear": 0, "zfar": 1});
    check(camera(json!({"type": "orthographic", "orthographic": ortho})), &["ymag 0"]);
}

#[test]
fn all_faults_are_reported_at_once() {
    check(
        |f| {
            f.json["materials"][0]["emissiveFactor"] = json!([0, -1, 0]);
            f.json["accessors"][0]["count"] = json!(5);
            f.light(json!({"name": "lamp"}), json!({"type": "point", "intensity": -1}));
        },
        &["emission", "reaches past its buffer view", "colour × intensity"],
    );
}

#[test]
fn buffers_must_be_there_and_whole() {
    check(|f| f.json["buffers"] = json!([{"byteLength": 4096}]), &["buffers[0]: it should hold 4096 bytes but has 60"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "gone.bin"}]), &["buffers[0]: can't read gone.bin"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "/dev/zero"}]), &["leads out of the folder"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "http://a/b"}]), &["is not a path relative"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "a%ff"}]), &["does not decode to UTF-8"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "data:;base64,!"}]), &["broken base64"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 4, "uri": "data:text,x"}]), &["not base64"]);
    check(|f| f.json["buffers"] = json!([{"byteLength": 60}, {"byteLength": 4}]), &["buffers[1]: no URI"]);
}

#[test]
fn bytes_alone_name_no_file() {
    let mut f = Fixture::quad();
    f.json["buffers"] = json!([{"byteLength": 4, "uri": "Cargo.toml"}]);
    let text = Scene::from_bytes(&f.glb(), "sent", None).unwrap_err().to_string();
    expect(&text, &["sent: buffers[0]: `Cargo.toml` is another file"]);
}

#[test]
fn textures_must_be_there_and_readable() {
    let textured = |image: serde_json::Value| {
        move |f: &mut Fixture| {
            f.json["images"] = json!([image]);
            f.json["textures"] = json!([{"source": 0}]);
            f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": 0}});
        }
    };
    // What can't be had is shown to be missing.
    let missing = |image: serde_json::Value, words: &[&str]| {
        let mut f = Fixture::quad();
        textured(image)(&mut f);
        let (scene, notices) = f.read().unwrap();
        let text = crate::diag::render(&notices);
        expect(&text, words);
        expect(&text, &["warning: test.glb: images[0]: ", "a magenta checker stands for it"]);
        assert_eq!(scene.textures.unwrap().mips[0][..8], [255, 0, 255, 255, 0, 0, 0, 255]);
    };
    missing(json!({"uri": "gone/wood.png"}), &["can't read gone/wood.png"]);
    missing(json!({"uri": "data:image/png;base64,AAAA"}), &["no readable PNG, JPEG, WebP or KTX2"]);
    missing(json!({"bufferView": 0}), &["no readable PNG, JPEG, WebP or KTX2"]);
    missing(json!({"bufferView": 9}), &["there is no buffer view 9"]);
    missing(json!({}), &["neither a URI nor a buffer view"]);
    let place = "materials[0] \"white\": base-colour texture: ";
    let index = |index: usize, source: usize| {
        move |f: &mut Fixture| {
            f.json["textures"] = json!([{"source": source}]);
            f.json["materials"][0]["pbrMetallicRoughness"] = json!({"baseColorTexture": {"index": index}});
        }
    };
    check(index(5, 0), &[place, "there is no texture 5"]);
    check(index(0, 5), &[place, "there is no image 5"]);
}

#[test]
fn required_extensions_and_versions_are_checked() {
    check(|f| f.json["asset"]["version"] = json!("1.0"), &["version 1.0 is not glTF 2"]);
    check(|f| f.json["extensionsRequired"] = json!(["NV_vertices_of_tomorrow"]), &["required but not supported"]);
}

#[test]
fn names_that_the_gltf_lacks_are_faults_with_the_nearest() {
    let mut f = Fixture::quad();
    f.light(json!({"name": "lamp"}), json!({"type": "point"}));
    let text = f.described(
        r#"Scene(
    materials: {"whit": (specular: 0.5)},
    motion: {"lmap": [(time: 0)]},
    camera: "front",
)"#,
    );
    let text = text.unwrap_err();
    expect(&text, &["test.glb has no material called \"whit\"", "did you mean `white`?", "test.ron:2:17"]);
    expect(&text, &["test.glb has no node called \"lmap\"", "did you mean `lamp`?", "test.ron:3:14"]);
    expect(&text, &["there is no camera \"front\"", "the scene has no cameras", "test.ron:4:13"]);
    f.node(json!({"name": "quad"}));
    let text = f.described(r#"Scene(motion: {"quad": [(time: 0)]})"#).unwrap_err();
    expect(&text, &["has 2 nodes called \"quad\""]);
}
