//! The words of the language, as docs/reference.md lists them; a test holds that to what there is.

use lightgraph::internals::builtin::REFERENCE;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// A word, what belongs to it (fields of a kind, columns of a table, the type of a value), and what is said of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    pub name: &'static str,
    pub parts: Vec<&'static str>,
    /// The type of a value, as shaders write it; else nothing.
    pub ty: &'static str,
    pub about: &'static str,
}

static SECTIONS: LazyLock<BTreeMap<&'static str, Vec<Word>>> = LazyLock::new(|| {
    let sections = REFERENCE.split("\n## ").skip(1).filter_map(|s| s.split_once('\n'));
    sections
        .map(|(title, text)| (title, text.lines().filter(|l| l.starts_with("| `")).flat_map(row).collect()))
        .collect()
});

fn quoted(text: &'static str) -> Vec<&'static str> {
    text.split('`').skip(1).step_by(2).collect()
}

fn row(line: &'static str) -> Vec<Word> {
    let cells: Vec<&str> = line.trim_start_matches("| ").trim_end_matches('|').split(" | ").map(str::trim).collect();
    let (names, rest) = (quoted(cells[0]), &cells[1..]);
    let about = rest.last().copied().unwrap_or("");
    let middle = if rest.len() > 1 { rest[0] } else { "" };
    let parts = quoted(middle);
    let ty = if parts.is_empty() { middle } else { "" };
    names.into_iter().map(|name| Word { name, parts: parts.clone(), ty, about }).collect()
}

/// The words under a heading of the reference.
pub fn section(title: &str) -> &'static [Word] {
    SECTIONS.get(title).map_or(&[], Vec::as_slice)
}

/// A word under a heading.
pub fn word(title: &str, name: &str) -> Option<&'static Word> {
    section(title).iter().find(|w| w.name == name)
}

/// What scenes and frames provide, with the noun for it.
pub fn provided(name: &str) -> Option<(&'static str, &'static Word)> {
    let kinds =
        [("Facts", "fact of the scene"), ("Frame values", "value of the frame"), ("Tables", "table of the scene")];
    kinds.iter().find_map(|(title, noun)| Some((*noun, word(title, name)?)))
}

/// The bare words that a field takes, where they are few.
pub fn choices(field: &str) -> &'static [&'static str] {
    match field {
        "history" | "depth_write" | "occluders" | "once" | "inclusive" => &["true", "false"],
        "cull" => &["None", "Front", "Back", "Material"],
        "blend" => &["Add", "Max", "Min", "Alpha"],
        "filter" => &["Nearest", "Linear"],
        "address" => &["Clamp", "Repeat", "Mirror"],
        "topology" => &["Triangles", "TriangleStrip", "Lines", "LineStrip", "Points"],
        "compare" | "depth_compare" => {
            &["Less", "LessEqual", "Greater", "GreaterEqual", "Equal", "NotEqual", "Always", "Never"]
        }
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_is_read() {
        let texture = word("Resources", "Texture").unwrap();
        assert_eq!((texture.parts[0], texture.about), ("format", "2D, or an array of layers"));
        assert!(word("Formats", "Rg32Float").is_some());
        let (noun, lights) = provided("light_views").unwrap();
        assert_eq!((noun, lights.ty), ("fact of the scene", "u32"));
        assert_eq!(word("Passes", "Use").unwrap().parts, ["name", "when", "group", "graph", "in", "out", "set"]);
        assert_eq!(word("Functions", "clamp").unwrap().about, "(x, low, high)");
    }
}
