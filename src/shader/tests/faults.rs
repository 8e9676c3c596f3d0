//! Every fault with its place; no text panics.

use super::*;

#[test]
fn unknown_paths_and_imports_name_the_nearest() {
    let files = library(&[("main.wgsl", "")]);
    let faults = compose(&files, "man.wgsl", &Defs::new(), &[]).expect_err("an unknown path");
    assert!(faults.to_string().contains("did you mean `main.wgsl`?"), "{faults}");
    let files = |main| [("lib/scene.wgsl", SCENE), ("lib/bare.wgsl", "fn f() {}"), ("main.wgsl", main)];
    let cases: [(&str, &[&str]); 9] = [
        ("#import scne::shine", &["unknown module `scne`", "main.wgsl:1:9", "did you mean `scene`?"]),
        ("\n#import scene::{shine,\n shne}", &["`scene` has no `shne`", "main.wgsl:3:2", "did you mean `shine`?"]),
        ("#import scene\n fn f() { _ = scene::xyz(); }", &["`scene` has no `xyz`", "main.wgsl:2:15"]),
        ("fn f() { nowhere::f(); }", &["unknown module `nowhere`", "main.wgsl:1:10"]),
        ("#import \"lib/bear.wgsl\"::f", &["did you mean `\"lib/bare.wgsl\"`?", "main.wgsl:1:9"]),
        ("#import \"lib/scene.wgsl\"::shine", &["that file is called `scene`"]),
        ("#import lib/bare.wgsl", &["unexpected text in an import", "main.wgsl:1:12", "quotes"]),
        ("#import", &["expected a name in an import"]),
        ("#import scene::shine\nfn shine() {}", &["both imported and declared", "main.wgsl:1:9", "declared here"]),
    ];
    for (main, expected) in cases {
        check_files(&files(main), &[], expected);
    }
}

#[test]
fn faults_in_imported_files_are_placed_there() {
    let main = "#import lib::f\n@fragment fn main() -> @location(0) vec4f { return vec4f(f()); }";
    let with = |lib: &str, expected: &[&str]| {
        let lib = format!("#define_import_path lib\n{lib}");
        check_files(&[("lib.wgsl", &lib), ("main.wgsl", main)], &[("N", Def::Int(12345))], expected);
    };
    with("fn f() -> f32 { return 1.0 }", &["lib.wgsl:2:28", "expected"]);
    with("fn f() -> f32 { let n = #{N}; return nope; }", &["lib.wgsl:2:38", "nope"]);
    with("var<uniform> u: f32;\nvar<uniform> v: f32; fn f() -> f32 { return u + v + 1u; }", &["lib.wgsl:3:"]);
    with("fn f() -> f32 { return 1u; }", &["lib.wgsl:2:24"]);
    with(
        "fn f() -> f32 { return 1.0; }\nstruct A { b: bool }\nvar<uniform> a: A;\nfn g() -> bool { return a.b; }",
        &["lib.wgsl:"],
    );
    with("fn f() -> f32 { return 1.0; }\nfn a__b() {}", &["lib.wgsl:", "`a__b` can't be exported"]);
    with("#if N == 1", &["never closed", "lib.wgsl:2:1"]);
    // Behind decorated names of a third file.
    let deep =
        "#define_import_path lib\n#import scene::{shine}\nfn f() -> f32 { return shine(0u) + shine(1u) + nope; }";
    check_files(&[("s.wgsl", SCENE), ("lib.wgsl", deep), ("main.wgsl", main)], &[], &["lib.wgsl:3:48"]);
    let wrong = "#define_import_path lib\n#import scene::{shine}\nfn f() -> f32 { return shine(0u, 2u); }";
    check_files(&[("s.wgsl", SCENE), ("lib.wgsl", wrong), ("main.wgsl", main)], &[], &["lib.wgsl:3:"]);
}

#[test]
fn validation_faults_are_placed_through_imports() {
    let lib = "#define_import_path lib\nfn helper(i: i32) -> i32 { return i; }\nvar<storage, read> data: array<i32>;\nfn f() -> i32 {\n  data[0] = 1;\n  return helper(2);\n}";
    let main = "#import lib::{f}\n@compute @workgroup_size(1) fn main() { _ = f(); }";
    check_files(&[("lib.wgsl", lib), ("main.wgsl", main)], &[], &["lib.wgsl:5:"]);
    let main = "#import lib::{helper}\n@compute @workgroup_size(1) fn main() {\n  _ = helper(helper(helper(1)));\n  if true { workgroupBarrier(); }\n}\n@fragment fn g() { workgroupBarrier(); }";
    check_files(&[("lib.wgsl", lib), ("main.wgsl", main)], &[], &["main.wgsl:6:"]);
}

#[test]
fn directive_faults_are_all_reported() {
    let expected = [
        "main.wgsl:2:1",
        "`#if N` needs a comparison",
        "main.wgsl:4:1",
        "unknown definition `M`",
        "main.wgsl:6:1",
        "`#endif` without",
        "main.wgsl:7:1",
        "`#else` without",
        "main.wgsl:8:1",
        "did you mean `ifdef`?",
        "main.wgsl:9:1",
        "`true`",
        "main.wgsl:11:11",
        "unknown definition `NN`",
        "main.wgsl:12:1",
        "definitions don't stand in shaders",
        "main.wgsl:13:13",
        "unexpected text after a directive",
        "main.wgsl:15:5",
        "stray `#`",
    ];
    check_files(
        &[(
            "main.wgsl",
            "\n#if N\n#endif\n#if M == 1\n#endif\n#endif\n#else\n#ifdeff N\n#if N == true\n#endif\nconst a = #{NN};\n#define X 1\n#ifdef N    more\n#endif\na = #N;",
        )],
        &[("N", Def::Int(1))],
        &expected,
    );
    check("/* open", &["a comment is never closed", "main.wgsl:1:1"]);
    check("#ifdef A\n#else\n#else\n#endif", &["a second `#else`", "main.wgsl:3:1"]);
}

#[test]
fn imports_in_a_circle_are_a_fault() {
    let a = "#define_import_path a\n#import b::g\nfn f() { b::g(); }";
    let b = "#define_import_path b\n#import a::f\nfn g() { a::f(); }";
    let main = "#import a::f\n@compute @workgroup_size(1) fn main() { f(); }";
    check_files(
        &[("a.wgsl", a), ("b.wgsl", b), ("main.wgsl", main)],
        &[],
        &["circle", "b.wgsl:2:9", "a.wgsl → b.wgsl"],
    );
    let own = "#define_import_path own\n#import own::f\nfn f() {}";
    check(own, &["circle", "main.wgsl:2:9"]);
}

#[test]
fn two_variables_of_one_name_are_a_fault() {
    let lib = "#define_import_path lib\nvar<uniform> gain: f32;\nfn f() -> f32 { return gain; }";
    let main = "#import lib::f\nvar<uniform> gain: f32;\n@fragment fn main() -> @location(0) vec4f { return vec4f(f() * gain); }";
    check_files(&[("lib.wgsl", lib), ("main.wgsl", main)], &[], &["`gain`", "lib.wgsl:2:14", "main.wgsl:2:14"]);
    let main =
        "#import lib::f\nvar<uniform> gain: f32;\n@fragment fn main() -> @location(0) vec4f { return vec4f(f()); }";
    assert_eq!(names(&composed(&[("lib.wgsl", lib), ("main.wgsl", main)], &[]).interface), ["gain"]);
}

#[test]
fn types_that_no_value_has_are_faults() {
    let with = |ty: &str, expected: &[&str]| {
        check(
            &format!(
                "struct S {{ x: {ty} }}\nvar<uniform> s: S;\n@compute @workgroup_size(1) fn main() {{ let a = s.x; }}"
            ),
            expected,
        );
    };
    with("mat3x3f", &["no value has the type of `x`", "mat4x4f", "main.wgsl:2:14"]);
    with("vec2i", &["no value has the type of `x`"]);
    with("array<vec4f, 2>", &["use plain members, or a storage buffer"]);
    with("bool", &["main.wgsl:", "use `u32`"]);
    check("override N: u32 = 1u;", &["`override` isn't supported", "main.wgsl:1:1"]);
    check("enable f16;", &["extensions aren't supported"]);
}

#[test]
fn no_text_panics() {
    let texts = [
        "",
        "\n",
        "// only a comment",
        "/* /* */",
        "\u{feff}",
        "\r\r\n",
        "#",
        "##",
        "#{",
        "#{}",
        "#{X}",
        "# {X",
        "#import {",
        "#import a::{{",
        "#import a::{b",
        "#import a as",
        "#import \"",
        "#import \"a\"",
        "#import \"\"::x",
        "\"",
        "\"a\"::b",
        "a::b",
        "::",
        "a::",
        "::a",
        "#if",
        "#if X",
        "#if X ==",
        "#if X == 99999999999999999999",
        "#else if",
        "#endif",
        "#define_import_path",
        "#define_import_path a b",
        "@",
        "@group",
        "@group(",
        "var",
        "var<",
        "var<uniform",
        "var<uniform>",
        "struct",
        "struct {",
        "}",
        ")",
        "fn",
        "fn f(",
        "fn __x() {}",
        "fn f__g() {}",
        "const é = 1;",
        "fn é() {}",
        "struct ÿ9 { x_: f32, é1: f32 }",
        "const 🦀 = 1;",
        "fn f() { let 日本 = 1; }",
        "var t: texture_2d<f32>; var t: sampler;",
        "X_naga_oil_mod_XNUYAX",
        "a.X_member_X",
        "@workgroup_size(0) @compute fn f() {}",
        "@compute fn f() {}",
        "@vertex fn f() {}",
        "fn f() { f(); }",
        "struct A { a: A }",
        "const a = b; const b = a;",
        "alias A = B; alias B = A;",
        "@compute @workgroup_size(1u << 40) fn f() {}",
        "var<private> x: array<f32, 0>;",
        "var<immediate> x: u32;",
        "const_assert false;",
        "diagnostic(off, x);",
        "\0",
        "fn f() { _ = 0x; }",
        "1e999",
        "\u{2028}",
        "a\u{0}b",
        "var<uniform> _naga: f32; fn g() -> f32 { return _naga; }",
    ];
    for text in texts {
        // A fault or not; never a panic, not in an import either.
        let _ = compose(&library(&[("main.wgsl", text)]), "main.wgsl", &Defs::new(), &[]);
        let lib = format!("#define_import_path lib\nfn ok() {{}}\n{text}");
        let main = "#import lib::ok\n@compute @workgroup_size(1) fn main() { ok(); }";
        let files = library(&[("lib.wgsl", &lib), ("main.wgsl", main)]);
        if let Err(faults) = compose(&files, "main.wgsl", &Defs::new(), &[]) {
            assert!(!faults.to_string().contains("gave up"), "{text:?}: {faults}");
        }
        files.index().mentioned(["main.wgsl"]);
    }
}

#[test]
fn cut_texts_do_not_panic() {
    let whole = "#import scene::{shine as s, materials}\n#if N == 1\nvar<uniform> é: f32; /* c */\n#endif\n@compute @workgroup_size(#{N}) fn main() { _ = s(0u) + materials[0].c1.x; }";
    let cuts = whole.char_indices().map(|(at, _)| at).filter(|at| at % 3 == 0);
    for at in cuts {
        let files = library(&[("lib.wgsl", SCENE), ("main.wgsl", &whole[..at])]);
        if let Err(faults) = compose(&files, "main.wgsl", &defs(&[("N", Def::Int(1))]), &[]) {
            assert!(!faults.to_string().contains("gave up"), "{faults}");
        }
    }
}
