//! What a variant makes of its base, and a graph of the one that it uses.

use crate::diag::{Checked, Source};
use crate::graph::ast::{Pass, PassKind};
use crate::graph::{Graph, load};
use std::path::Path;

const BASE: &str = r#"Graph(
    resources: {
        "a": Texture(format: R32Float, size: 8),
        "b": Texture(format: R32Float, size: 8),
        "c": Texture(format: R32Float, size: 8),
    },
    passes: [
        Clear(name: "one", target: "a", value: (0, 0, 0, 0)),
        Loop(name: "n", count: 2, passes: [Copy(name: "two", from: "a", to: "b")]),
        Use(name: "sub", graph: "sub.ron", in: {"given": "b"}),
        Copy(name: "three", from: "b", to: "c"),
    ],
    outputs: {"o": "c"},
)"#;

const SUB: &str = r#"Graph(
    inputs: {"given": Texture()},
    resources: {"own": Texture(format: R32Float, size: 8)},
    passes: [Copy(name: "four", from: "given", to: "own")],
    outputs: {"made": "own"},
)"#;

fn varied(changes: &str) -> Checked<Graph> {
    let variant = format!("Variant(base: \"base.ron\", {changes})");
    let read = |path: &Path| {
        let text = match path.to_str() {
            Some("base.ron") => BASE,
            Some("sub.ron") => SUB,
            _ => variant.as_str(),
        };
        Ok(Source::new(path.display().to_string(), text))
    };
    load(Path::new("v.ron"), &read)
}

/// The passes in their order: what a copy reads and writes, in brackets what a loop holds.
fn passes(changes: &str) -> String {
    fn said(pass: &Pass) -> String {
        let name = &pass.name.value;
        match &pass.kind {
            PassKind::Copy { from, to } => format!("{name}({}→{})", from.value, to.value),
            PassKind::Loop { passes, .. } => format!("{name}[{}]", all(passes)),
            _ => name.clone(),
        }
    }
    fn all(passes: &[Pass]) -> String {
        passes.iter().map(said).collect::<Vec<_>>().join(" ")
    }
    all(&varied(changes).unwrap_or_else(|f| panic!("{changes}\n{f}")).passes)
}

fn fault(changes: &str) -> String {
    varied(changes).map(drop).expect_err(changes).to_string()
}

#[test]
fn without_changes_the_base_is_as_it_was() {
    assert_eq!(passes(""), "one n[two(a→b)] sub.four(b→sub.own) three(b→c)");
}

#[test]
fn a_pass_is_changed_replaced_and_removed_where_it_stands() {
    assert_eq!(passes(r#"passes: {"two": (from: "c")}"#), "one n[two(c→b)] sub.four(b→sub.own) three(b→c)");
    // It keeps its name unless it has another.
    assert_eq!(
        passes(r#"passes: {"two": Copy(from: "c", to: "b"), "three": Copy(name: "last", from: "a", to: "c")}"#),
        "one n[two(c→b)] sub.four(b→sub.own) last(a→c)"
    );
    assert_eq!(
        passes(r#"passes: {"sub.four": Copy(from: "given", to: "own"), "one": None}"#),
        "n[two(a→b)] sub.four(b→sub.own) three(b→c)"
    );
}

#[test]
fn new_passes_stand_before_after_and_behind_all() {
    let copy = |name: &str| format!("[Copy(name: \"{name}\", from: \"a\", to: \"b\")]");
    let (x, y, z) = (copy("x"), copy("y"), copy("z"));
    assert_eq!(
        passes(&format!("before: {{\"two\": {x}}}, after: {{\"three\": {y}}}, append: {z}")),
        "one n[x(a→b) two(a→b)] sub.four(b→sub.own) three(b→c) y(a→b) z(a→b)"
    );
    assert_eq!(
        passes(&format!("after: {{\"two\": {x}, \"one\": {y}, \"y\": {z}}}")),
        "one y(a→b) z(a→b) n[two(a→b) x(a→b)] sub.four(b→sub.own) three(b→c)",
        "beside a new one, too"
    );
    let renamed = r#"passes: {"three": Copy(name: "last", from: "b", to: "c")}"#;
    for name in ["three", "last"] {
        assert_eq!(
            passes(&format!("{renamed}, before: {{\"{name}\": {x}}}")),
            "one n[two(a→b)] sub.four(b→sub.own) x(a→b) last(b→c)",
            "by the name in the base and by its own"
        );
    }
}

#[test]
fn what_a_variant_can_t_change_is_a_fault() {
    for (changes, words) in [
        (r#"passes: {"thre": None}"#, "did you mean `three`?"),
        (r#"passes: {"three": None, "three": None}"#, "`three` stands twice"),
        (r#"passes: {"three": 3}"#, "expected changes"),
        (r#"after: {"sub.fur": []}"#, "did you mean `sub.four`?"),
        (r#"append: [Copy(name: "x", from: "a", to: "b", quality: 3)]"#, "it has name, "),
        (r#"append: [Copy(name: "x", from: "a")]"#, "`Copy` needs a field `to`"),
    ] {
        let said = fault(changes);
        assert!(said.contains(words), "{changes}\n{said}");
    }
}
