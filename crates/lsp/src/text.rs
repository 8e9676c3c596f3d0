//! Lines and columns as editors count them.

use lightgraph::internals::diag::Source;
use lsp_types::{Position, Range, TextDocumentContentChangeEvent};
use std::ops;
use std::sync::Arc;

/// In what columns are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnUnit {
    Bytes,
    /// The units of UTF-16, which every editor knows.
    Utf16,
}

/// Where the lines of a text start.
#[derive(Debug)]
pub struct LineStarts {
    pub source: Arc<Source>,
    starts: Vec<usize>,
    columns: ColumnUnit,
}

impl LineStarts {
    pub fn new(source: &Arc<Source>, columns: ColumnUnit) -> LineStarts {
        let starts = std::iter::once(0).chain(source.text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        LineStarts { source: source.clone(), starts, columns }
    }

    /// The place of a byte; one inside of a character is that of the character.
    pub fn position(&self, byte: usize) -> Position {
        let byte = floor(&self.source.text, byte);
        let line = self.starts.partition_point(|start| *start <= byte).saturating_sub(1);
        let before = &self.source.text[self.starts[line]..byte];
        let column = match self.columns {
            ColumnUnit::Bytes => before.len(),
            ColumnUnit::Utf16 => before.chars().map(char::len_utf16).sum(),
        };
        Position::new(line as u32, column as u32)
    }

    pub fn range(&self, bytes: &ops::Range<usize>) -> Range {
        Range::new(self.position(bytes.start), self.position(bytes.end.max(bytes.start)))
    }

    /// The byte of a place; beyond a line its end, beyond the text that of the text.
    pub fn byte(&self, at: Position) -> usize {
        let Some(start) = self.starts.get(at.line as usize) else { return self.source.text.len() };
        let end = self.starts.get(at.line as usize + 1).map_or(self.source.text.len(), |next| next - 1);
        let line = &self.source.text[*start..end];
        let line = line.strip_suffix('\r').unwrap_or(line);
        let wanted = at.character as usize;
        let within = match self.columns {
            ColumnUnit::Bytes => floor(line, wanted),
            ColumnUnit::Utf16 => {
                let mut column = 0;
                let found = line.char_indices().find(|(_, c)| {
                    column += c.len_utf16();
                    column > wanted
                });
                found.map_or(line.len(), |(at, _)| at)
            }
        };
        start + within
    }
}

fn floor(text: &str, byte: usize) -> usize {
    let mut at = byte.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}

/// The text after a change that an editor tells of.
pub fn changed(source: &Arc<Source>, change: TextDocumentContentChangeEvent, columns: ColumnUnit) -> String {
    let Some(range) = change.range else { return change.text };
    let (text, lines) = (&source.text, LineStarts::new(source, columns));
    let (start, end) = (lines.byte(range.start), lines.byte(range.end));
    let mut out = String::with_capacity(text.len() + change.text.len());
    out.push_str(&text[..start.min(end)]);
    out.push_str(&change.text);
    out.push_str(&text[start.max(end)..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_counted_as_the_editor_does() {
        let source = Source::new("a", "ab\r\nü𝄞c\n");
        for (columns, places) in
            [(ColumnUnit::Utf16, [(1, 1, 6), (1, 3, 10)]), (ColumnUnit::Bytes, [(1, 2, 6), (1, 6, 10)])]
        {
            let lines = LineStarts::new(&source, columns);
            for (line, column, byte) in places {
                assert_eq!(lines.byte(Position::new(line, column)), byte);
                assert_eq!(lines.position(byte), Position::new(line, column));
            }
            assert_eq!(lines.byte(Position::new(0, 99)), 2);
            assert_eq!(lines.byte(Position::new(9, 0)), source.text.len());
            assert_eq!(lines.position(999), Position::new(2, 0));
        }
    }

    #[test]
    fn changes_follow_each_other() {
        let edit = |text: &str, from: (u32, u32), to: (u32, u32), new: &str, columns| {
            let range = Some(Range::new(Position::new(from.0, from.1), Position::new(to.0, to.1)));
            let change = TextDocumentContentChangeEvent { range, range_length: None, text: new.into() };
            changed(&Source::new("a", text), change, columns)
        };
        assert_eq!(edit("a\nü b", (1, 1), (1, 2), "—", ColumnUnit::Utf16), "a\nü—b");
        assert_eq!(edit("a\nb", (7, 1), (0, 0), "x", ColumnUnit::Utf16), "x");
        let whole = TextDocumentContentChangeEvent { range: None, range_length: None, text: "b".into() };
        assert_eq!(changed(&Source::new("a", "a"), whole, ColumnUnit::Bytes), "b");
    }
}
