//! What a layout keeps and what it changes: examples, every shipped file, random ones.

use super::*;
use crate::graph::tree::Field;
use proptest::prelude::*;

fn formatted(text: &str) -> String {
    format(&Source::new("t.ron", text)).unwrap_or_else(|f| panic!("{f}\n{text}"))
}

/// What a tree says, apart from where it says it: texts with one space for any white space.
fn said(node: &SyntaxNode) -> String {
    let all = |nodes: &[SyntaxNode]| nodes.iter().map(said).collect::<Vec<_>>().join(",");
    let name = |name: &Option<Span>| name.as_ref().map_or(String::new(), |n| n.text().to_string());
    match &node.kind {
        SyntaxKind::Word => node.span.text().into(),
        SyntaxKind::Text => node.span.text().split_whitespace().collect::<Vec<_>>().join(" "),
        SyntaxKind::List(items) => format!("[{}]", all(items)),
        SyntaxKind::Tuple(head, items) => format!("{}({})", name(head), all(items)),
        SyntaxKind::Map(pairs) => {
            let pairs: Vec<String> = pairs.iter().map(|(k, v)| format!("{}:{}", said(k), said(v))).collect();
            format!("{{{}}}", pairs.join(","))
        }
        SyntaxKind::Struct(head, fields) => {
            let one = |f: &Field| format!("{}={}", f.name.text(), said(&f.value));
            format!("{}({})", name(head), fields.iter().map(one).collect::<Vec<_>>().join(","))
        }
    }
}

/// Comments, word by word.
fn comments(text: &str) -> Vec<String> {
    let mut found = vec![];
    let (mut rest, mut quoted) = (text, false);
    while let Some(c) = rest.chars().next() {
        let mut step = c.len_utf8();
        if c == '"' {
            quoted = !quoted;
        } else if !quoted && rest.starts_with("//") {
            step = rest.find('\n').unwrap_or(rest.len());
            found.extend(rest[..step].trim_start_matches(['/', '!']).split_whitespace().map(String::from));
        } else if !quoted && rest.starts_with("/*") {
            step = comment(rest).unwrap_or(rest.len());
            found.push(rest[..step].into());
        }
        rest = &rest[step..];
    }
    found
}

fn holds(text: &str) {
    let Ok(before) = parse(&Source::new("t.ron", text)) else { return };
    let once = formatted(text);
    let after = parse(&Source::new("t.ron", once.as_str())).unwrap_or_else(|f| panic!("{f}\n{text}\n→\n{once}"));
    assert_eq!(said(&before), said(&after), "{text}\n→\n{once}");
    assert_eq!(comments(text), comments(&once), "{text}\n→\n{once}");
    assert_eq!(once, formatted(&once), "{text}");
}

#[test]
fn lines_and_comments_stay_and_the_rest_follows() {
    let text = r#"// head
Graph( about:"x",


  m : {"a":Uint( default:4 ), // four
 /* b */ "b": true},
  l:[A(x:1),B,],
)"#;
    let told = r#"// head
Graph(
    about: "x",

    m: {
        "a": Uint(default: 4), // four
        /* b */
        "b": true,
    },
    l: [A(x: 1), B],
)
"#;
    assert_eq!(formatted(text), told);
    let hugged = r#"Graph(
    passes: [
        For(name: "i", count: "n", passes: [
            Screen(name: "a"),
        ]),
    ],
)
"#;
    assert_eq!(formatted(hugged), hugged);
    let long = format!("(a: \"{}\", b: 1)", "word ".repeat(30).trim());
    assert!(formatted(&long).lines().all(|l| l.len() <= WIDTH), "{}", formatted(&long));
    // What fits on a line of its own stays on one, however near the end of the line its brackets close.
    for digits in 40..=80 {
        let last = format!("A(x: {})", "1".repeat(digits));
        let text = formatted(&format!("Graph(l: [B, {last}])"));
        assert!(text.contains(&last) && text.lines().all(|l| l.len() <= WIDTH), "{text}");
    }
    for text in [
        "[ // c\na]",
        "a",
        "()",
        "Graph()",
        "[\n]",
        "{ // c\n}",
        "#![enable(implicit_some)]\n(a: 1)",
        "(a: /* c */ 1)",
        "1 // c",
    ] {
        holds(text);
    }
}

#[test]
fn shipped_files_say_the_same_in_the_one_layout() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders: Vec<std::path::PathBuf> =
        ["graphs", "tests", "scenes", "template", "benches", "docs"].map(|f| root.join(f)).into();
    let mut count = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "ron")
                && let Ok(text) = std::fs::read_to_string(&path)
            {
                holds(&text);
                count += 1;
            }
        }
    }
    assert!(count > 100, "{count}");
}

/// RON of few shapes, with white space and comments anywhere.
fn ron() -> impl Strategy<Value = String> {
    let space = prop_oneof![
        4 => Just(String::new()),
        2 => Just(" ".into()),
        2 => Just("\n".into()),
        1 => Just("\n\n  ".into()),
        1 => Just(" // said\n".into()),
        1 => Just("/* b\n c */".into()),
    ];
    let leaf = prop_oneof![
        "[a-z]{1,8}".prop_map(String::from),
        "[0-9]{1,3}".prop_map(String::from),
        "[a-z ]{0,90}".prop_map(|t| format!("\"{t}\"")),
        "[a-z]{1,4}\n +[a-z ]{0,120}".prop_map(|t| format!("\"{t}\"")),
    ];
    leaf.prop_recursive(4, 40, 5, move |inner| {
        let item = (space.clone(), inner.clone(), space.clone(), space.clone());
        let items = prop::collection::vec(item, 0..5);
        (items, 0..4usize, any::<bool>()).prop_map(|(items, shape, named)| {
            let name = if named && shape > 1 { "Name" } else { "" };
            let (open, close) = [("[", "]"), ("{", "}"), ("(", ")"), ("(", ")")][shape];
            let mut text = format!("{name}{open}");
            for (i, (before, value, after, more)) in items.iter().enumerate() {
                let key = match shape {
                    1 => format!("\"k{i}\"{more}:{more}"),
                    3 => format!("f{i}{more}: "),
                    _ => String::new(),
                };
                text += &format!("{before}{key}{value}{after},{more}");
            }
            text + close
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100_000))]
    #[test]
    fn random_files_say_the_same_in_the_one_layout(text in ron()) {
        holds(&text);
    }
}
