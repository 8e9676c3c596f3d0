//! The parts of a document: symbols, folds, hints at what expressions come to, and what passes took.

use crate::computed::Computed;
use crate::graphs::is_ron;
use crate::mentions::{GraphFile, PassMention};
use crate::ron::{TokenShape, WordRole, role, walk};
use crate::status::Status;
use crate::text::LineStarts;
use lightgraph::internals::shader::survey;
use lsp_types::{
    CodeLens, Command, DocumentSymbol, FoldingRange, InlayHint, InlayHintKind, InlayHintLabel, SymbolKind,
};
use std::ops::Range;
use std::path::Path;

#[expect(deprecated, reason = "a field of the protocol's type that nobody may leave out")]
fn symbol(
    name: &str,
    detail: &str,
    kind: SymbolKind,
    lines: &LineStarts,
    range: &Range<usize>,
    place: &Range<usize>,
) -> DocumentSymbol {
    // What is selected must lie in the whole, or editors refuse all of it.
    let whole = range.start.min(place.start)..range.end.max(place.end);
    DocumentSymbol {
        // Editors refuse empty names.
        name: if name.is_empty() { "…".into() } else { name.into() },
        detail: Some(detail.to_string()).filter(|d| !d.is_empty()),
        kind,
        tags: None,
        deprecated: None,
        range: lines.range(&whole),
        selection_range: lines.range(place),
        children: None,
    }
}

/// The declarations and passes of a document, those in others below them.
pub fn symbols(path: &Path, lines: &LineStarts) -> Vec<DocumentSymbol> {
    if is_ron(path) {
        let file = GraphFile::new(&lines.source);
        let end = lines.source.text.len();
        let mut all: Vec<(Range<usize>, DocumentSymbol)> = vec![];
        for d in &file.declared {
            let kind = match d.section {
                "resources" | "inputs" => SymbolKind::VARIABLE,
                "outputs" => SymbolKind::INTERFACE,
                _ => SymbolKind::CONSTANT,
            };
            let detail = if d.kind.is_empty() { d.section } else { &d.kind };
            all.push((d.range.clone(), symbol(&d.name, detail, kind, lines, &d.range, &d.place)));
        }
        for p in &file.passes {
            let range = p.range.start..p.range.end.min(end);
            let place = if p.place.is_empty() { range.start..range.start } else { p.place.clone() };
            all.push((range.clone(), symbol(&p.name, &p.kind, SymbolKind::FUNCTION, lines, &range, &place)));
        }
        all.sort_by_key(|(range, _)| (range.start, std::cmp::Reverse(range.end)));
        return nested(all);
    }
    let shader = survey(&lines.source);
    let mut declared: Vec<_> = shader.outline.declared.iter().collect();
    declared.sort_by_key(|(_, d)| d.range.start);
    let kind = |keyword: &str| match keyword {
        "fn" => SymbolKind::FUNCTION,
        "struct" => SymbolKind::STRUCT,
        "const" => SymbolKind::CONSTANT,
        _ => SymbolKind::VARIABLE,
    };
    declared.iter().map(|(name, d)| symbol(name, &d.keyword, kind(&d.keyword), lines, &d.range, &d.range)).collect()
}

/// Symbols in symbols at most: who writes them out goes into each.
const DEEPEST: usize = 32;

/// Puts each into the one before that holds it.
fn nested(all: Vec<(Range<usize>, DocumentSymbol)>) -> Vec<DocumentSymbol> {
    let mut open: Vec<(Range<usize>, DocumentSymbol)> = vec![];
    let mut done = vec![];
    let mut close = |open: &mut Vec<(Range<usize>, DocumentSymbol)>| {
        let Some((_, symbol)) = open.pop() else { return };
        match open.last_mut() {
            Some((_, outer)) => outer.children.get_or_insert_default().push(symbol),
            None => done.push(symbol),
        }
    };
    for (range, symbol) in all {
        while open.len() >= DEEPEST || open.last().is_some_and(|(outer, _)| outer.end <= range.start) {
            close(&mut open);
        }
        open.push((range, symbol));
    }
    while !open.is_empty() {
        close(&mut open);
    }
    done
}

/// What can be folded: brackets over several lines.
pub fn folds(path: &Path, lines: &LineStarts) -> Vec<FoldingRange> {
    let mut ranges = vec![];
    if is_ron(path) {
        walk(&lines.source.text, &mut |token, _| {
            if token.shape == TokenShape::Close {
                ranges.push(token.range.clone());
            }
        });
    } else {
        let shader = survey(&lines.source);
        let mut open = vec![];
        for token in &shader.words {
            if token.is('{') {
                open.push(token.range.start);
            } else if token.is('}') {
                ranges.extend(open.pop().map(|start| start..token.range.end));
            }
        }
    }
    let fold = |range: &Range<usize>| {
        let range = lines.range(range);
        let (start_line, end_line) = (range.start.line, range.end.line.saturating_sub(1));
        (start_line < end_line).then(|| FoldingRange { start_line, end_line, ..FoldingRange::default() })
    };
    ranges.iter().filter_map(fold).collect()
}

/// Beside each pass what it took last and why it ran, where something shows the graph.
pub fn lenses(path: &Path, lines: &LineStarts) -> Vec<CodeLens> {
    let Some(status) = Status::read(path) else { return vec![] };
    let file = GraphFile::new(&lines.source);
    let lens = |pass: &PassMention| {
        let title = status.words(&pass.name)?;
        // A command without a name is words alone.
        let command = Command { title, command: String::new(), arguments: None };
        Some(CodeLens { range: lines.range(&pass.place), command: Some(command), data: None })
    };
    file.passes.iter().filter(|p| !p.place.is_empty()).filter_map(lens).collect()
}

/// What expressions and sizes come to, behind them.
pub fn hints(lines: &LineStarts, computed: &Computed, within: &Range<usize>) -> Vec<InlayHint> {
    let mut hints = vec![];
    let mut hint = |byte: usize, text: String| {
        if within.contains(&byte) {
            hints.push(InlayHint {
                position: lines.position(byte),
                label: InlayHintLabel::String(text),
                kind: Some(InlayHintKind::TYPE),
                text_edits: None,
                tooltip: None,
                padding_left: Some(true),
                padding_right: None,
                data: None,
            });
        }
    };
    walk(&lines.source.text, &mut |token, frames| {
        if token.shape == TokenShape::Text
            && role(frames, token.shape, token.key) == WordRole::Expression
            && let Some(value) = computed.value_of(token.text)
        {
            hint(token.range.end + 1, format!("= {value}"));
        }
    });
    let file = GraphFile::new(&lines.source);
    for d in file.declared.iter().filter(|d| ["resources", "inputs"].contains(&d.section)) {
        if let Some(size) = computed.sizes.get(&d.name) {
            hint(d.range.end, size.clone());
        }
    }
    hints
}
