//! Edits that faults propose: the nearest name, to leave out what nothing uses, what a resource holds at first.

use crate::mentions::GraphFile;
use crate::text::LineStarts;
use crate::told::HELP;
use lightgraph::internals::graph::tree::{self, SyntaxKind, SyntaxNode};
use lsp_types::{CodeAction, CodeActionKind, CodeActionOrCommand, Diagnostic, TextEdit, Uri, WorkspaceEdit};
use std::ops::Range;

/// The edits for the faults that an editor shows at a place.
pub fn fixes(uri: &Uri, lines: &LineStarts, diagnostics: Vec<Diagnostic>) -> Vec<CodeActionOrCommand> {
    let mut found = vec![];
    for d in diagnostics.into_iter().filter(|d| d.source.as_deref() == Some("lightgraph")) {
        for (title, range, text) in edits(lines, &d) {
            let edit = TextEdit { range: lines.range(&range), new_text: text };
            let edit = WorkspaceEdit { changes: Some([(uri.clone(), vec![edit])].into()), ..WorkspaceEdit::default() };
            found.push(CodeActionOrCommand::CodeAction(CodeAction {
                title,
                kind: Some(CodeActionKind::QUICKFIX),
                diagnostics: Some(vec![d.clone()]),
                edit: Some(edit),
                is_preferred: Some(true),
                ..CodeAction::default()
            }));
        }
    }
    found
}

/// The edits that a fault proposes: what each does, what it replaces, and by what.
fn edits(lines: &LineStarts, d: &Diagnostic) -> Vec<(String, Range<usize>, String)> {
    let range = lines.byte(d.range.start)..lines.byte(d.range.end);
    let text = &lines.source.text;
    let mut found = vec![];
    let near =
        d.message.lines().filter_map(|l| l.strip_prefix(HELP)?.strip_prefix("did you mean `")?.strip_suffix("`?"));
    // The word that the message is about, where it stands.
    let quoted = d.message.lines().next().unwrap_or("").split('`').skip(1).step_by(2);
    let wrong: Vec<&str> = quoted.collect();
    for name in near {
        let here = text.get(range.clone()).unwrap_or("");
        let place = wrong.iter().find_map(|word| {
            let at = here.find(word).filter(|_| !word.is_empty())?;
            Some(range.start + at..range.start + at + word.len())
        });
        if let Some(place) = place {
            found.push((format!("Replace by `{name}`"), place, name.to_string()));
        }
    }
    let unused =
        d.message.starts_with("nothing uses the") || d.message.starts_with("no shader mentions the definition");
    if unused && let Some(entry) = tree::parse(&lines.source).ok().and_then(|root| entry(&root, range.start)) {
        let name = wrong.first().copied().unwrap_or("it");
        found.push((format!("Remove `{name}`"), with_comma(text, entry), String::new()));
    }
    // The resource that is read before anything writes it, where this file declares it.
    let blank = d.message.lines().filter_map(|l| {
        let (_, rest) = l.strip_prefix(HELP)?.split_once("give `")?;
        rest.split_once("` an `initial` value").map(|(name, _)| name)
    });
    for name in blank {
        for field in ["initial: (0, 0, 0, 0)", "history: true"] {
            found.extend(with_field(lines, name, field).map(|at| {
                let added = if text[..at].ends_with('(') { field.into() } else { format!(", {field}") };
                (format!("Give `{name}` the field `{field}`"), at..at, added)
            }));
        }
    }
    found
}

/// Where a resource of the file takes one more field: behind the last one and its comma.
fn with_field(lines: &LineStarts, name: &str, field: &str) -> Option<usize> {
    let file = GraphFile::new(&lines.source);
    let declared = file.declared.iter().find(|d| d.section == "resources" && d.name == name)?;
    let whole = lines.source.text.get(declared.range.clone())?;
    let key = field.split(':').next()?;
    // The fault is older than the text.
    if whole.contains(key) {
        return None;
    }
    let inside = whole.strip_suffix(')')?.trim_end();
    let inside = inside.strip_suffix(',').unwrap_or(inside).trim_end();
    Some(declared.range.start + inside.len())
}

/// The entry of a map whose key holds a byte.
fn entry(node: &SyntaxNode, byte: usize) -> Option<Range<usize>> {
    let holds = |n: &SyntaxNode| n.span.start <= byte && byte < n.span.end;
    match &node.kind {
        SyntaxKind::Map(pairs) => {
            pairs.iter().find_map(
                |(key, value)| {
                    if holds(key) { Some(key.span.start..value.span.end) } else { entry(value, byte) }
                },
            )
        }
        SyntaxKind::Struct(_, fields) => fields.iter().filter(|f| holds(&f.value)).find_map(|f| entry(&f.value, byte)),
        SyntaxKind::List(items) | SyntaxKind::Tuple(_, items) => {
            items.iter().filter(|n| holds(n)).find_map(|n| entry(n, byte))
        }
        SyntaxKind::Text | SyntaxKind::Word => None,
    }
}

/// An entry with the comma behind it, and with its line where it has one of its own.
fn with_comma(text: &str, entry: Range<usize>) -> Range<usize> {
    let rest = &text[entry.end..];
    let blank = rest.len() - rest.trim_start().len();
    let mut end = if rest[blank..].starts_with(',') { entry.end + blank + 1 } else { entry.end };
    let mut start = entry.start;
    let before = text[..start].trim_end_matches([' ', '\t']).len();
    let own_line = text[..before].ends_with('\n') && text[end..].trim_start_matches([' ', '\t']).starts_with('\n');
    if own_line {
        start = before;
        end += text[end..].find('\n').map_or(0, |at| at + 1);
    }
    start..end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::ColumnUnit;
    use lightgraph::internals::diag::Source;

    fn fixed(text: &str, at: Range<usize>, message: &str) -> Vec<String> {
        let lines = LineStarts::new(&Source::new("a.ron", text), ColumnUnit::Utf16);
        let d = Diagnostic { range: lines.range(&at), message: message.into(), ..Diagnostic::default() };
        let apply = |(_, range, new): (String, Range<usize>, String)| {
            format!("{}{new}{}", &text[..range.start], &text[range.end..])
        };
        edits(&lines, &d).into_iter().map(apply).collect()
    }

    #[test]
    fn the_nearest_name_takes_the_place_of_a_slip() {
        let text = "Graph(lets: {\"a\": \"gird.x\"})";
        let at = text.find("gird").unwrap();
        let message = "unknown name `gird.x`\nhelp: did you mean `grid.x`?";
        assert_eq!(fixed(text, at..at + 6, message), ["Graph(lets: {\"a\": \"grid.x\"})"]);
        assert_eq!(fixed(text, at..at + 6, "unknown name\nhelp: did you mean `grid`?"), [""; 0]);
    }

    #[test]
    fn what_is_read_too_early_gets_a_content() {
        let message = "`p` reads `r`, which nothing writes\nhelp: write it in an earlier pass, or give `r` an \
                       `initial` value, or `history: true` for last frame's";
        for (old, new) in [
            ("Texture(format: R8Unorm)", "Texture(format: R8Unorm, initial: (0, 0, 0, 0))"),
            ("Texture(\n    format: R8Unorm,\n)", "Texture(\n    format: R8Unorm, initial: (0, 0, 0, 0),\n)"),
            ("Buffer()", "Buffer(initial: (0, 0, 0, 0))"),
        ] {
            let text = |resource: &str| format!("Graph(resources: {{\"r\": {resource}, \"s\": Buffer()}})");
            let found = fixed(&text(old), 0..1, message);
            assert_eq!(found.first(), Some(&text(new)));
            assert_eq!(found.len(), 2);
        }
        let other = "Graph(resources: {\"s\": Buffer()})";
        assert_eq!(fixed(other, 0..1, message), [""; 0]);
    }

    #[test]
    fn what_nothing_uses_goes_with_its_line() {
        let text = "Graph(\n    lets: {\n        \"a\": \"1\",\n        \"b\": \"2\",\n    },\n)";
        let at = text.find("a\"").unwrap();
        let removed = "Graph(\n    lets: {\n        \"b\": \"2\",\n    },\n)";
        assert_eq!(fixed(text, at..at + 1, "nothing uses the let `a`"), [removed]);
        let text = "Graph(lets: {\"a\": \"1\", \"b\": \"2\"})";
        let at = text.find("b\"").unwrap();
        assert_eq!(fixed(text, at..at + 1, "nothing uses the let `b`"), ["Graph(lets: {\"a\": \"1\", })"]);
    }
}
