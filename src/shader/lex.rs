//! Words of a WGSL text: enough to see comments, directives, declarations and names, and no more.

use crate::diag::{Diagnostic, Source, Span};
use std::{ops::Range, sync::Arc};

/// A word of a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    pub kind: TokenKind,
    /// Bytes of the text.
    pub range: Range<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TokenKind {
    /// An identifier or a path of them: `a`, `a::b`, `"a/b.wgsl"::c`; also `a::` before a brace.
    Name,
    Number,
    /// `#{NAME}`, the value of a definition.
    Definition,
    /// Any other character.
    Mark(char),
}

impl Token {
    /// What the text says here.
    pub fn text<'a>(&self, text: &'a str) -> &'a str {
        text.get(self.range.clone()).unwrap_or("")
    }

    /// The definition's name in `#{NAME}`.
    pub fn definition<'a>(&self, text: &'a str) -> &'a str {
        self.text(text).trim_start_matches(['#', '{', ' ', '\t']).trim_end_matches(['}', ' ', '\t'])
    }

    /// True for this one character.
    pub fn is(&self, mark: char) -> bool {
        self.kind == TokenKind::Mark(mark)
    }
}

/// The text with every comment, carriage return and byte order mark blanked, byte for byte as long as before.
/// A lone carriage return ends a line, as in WGSL. Block comments nest.
pub(super) fn blank_comments(source: &Arc<Source>, faults: &mut Vec<Diagnostic>) -> String {
    let text = &source.text;
    let mut out = String::with_capacity(text.len());
    let mut line_comment = false;
    let mut block_starts: Vec<usize> = vec![];
    let mut at = 0;
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let in_block = !block_starts.is_empty();
        // Most of a text is taken as it is, or blanked, up to a byte that may begin something else.
        let length = |other: fn(u8) -> bool| rest.bytes().position(other).unwrap_or(rest.len());
        let same = match (in_block, line_comment) {
            (false, false) => length(|b| matches!(b, b'/' | b'\r' | 0xef)),
            (false, true) => length(|b| matches!(b, b'\n' | b'\r')),
            (true, _) => 0,
        };
        if same > 0 {
            if line_comment {
                blank(&mut out, same)
            } else {
                out.push_str(&rest[..same])
            }
            at += same;
            continue;
        }
        let mut chars = rest.chars();
        let Some(c) = chars.next() else { break };
        let mut length = c.len_utf8();
        match (c, chars.next()) {
            ('\r', Some('\n')) => out.push(' '),
            ('\n' | '\r', _) => {
                line_comment = false;
                out.push('\n');
            }
            ('/', Some('*')) if !line_comment => {
                block_starts.push(at);
                length = 2;
                out.push_str("  ");
            }
            ('*', Some('/')) if in_block => {
                block_starts.pop();
                length = 2;
                out.push_str("  ");
            }
            ('/', Some('/')) if !in_block => {
                line_comment = true;
                out.push(' ');
            }
            _ if in_block || line_comment || c == '\u{feff}' => blank(&mut out, length),
            _ => out.push(c),
        }
        at += length;
    }
    if let Some(start) = block_starts.first() {
        let place = Span::new(source, *start..start + 2);
        faults
            .push(Diagnostic::error("a comment is never closed").at(&place, "opened here").help("close it with `*/`"));
    }
    out
}

/// Appends `count` spaces.
pub(super) fn blank(out: &mut String, count: usize) {
    out.extend(std::iter::repeat_n(' ', count));
}

/// The words of `text[range]`, which has no comments. Ranges count from the start of `text`.
pub(super) fn tokens(text: &str, range: Range<usize>) -> Vec<Token> {
    let part = text.get(range.clone()).unwrap_or("");
    let mut out = vec![];
    let mut at = 0;
    while let Some(c) = part[at..].chars().next() {
        let rest = &part[at..];
        let (kind, length) = if c.is_whitespace() {
            at += c.len_utf8();
            continue;
        } else if starts_name(c) || (c == '"' && quoted(rest).is_some()) {
            (TokenKind::Name, name_length(rest))
        } else if c.is_ascii_digit() {
            let length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '.' && c != '_');
            (TokenKind::Number, length.unwrap_or(rest.len()))
        } else if let Some(length) = definition_length(rest) {
            (TokenKind::Definition, length)
        } else {
            (TokenKind::Mark(c), c.len_utf8())
        };
        out.push(Token { kind, range: range.start + at..range.start + at + length });
        at += length;
    }
    out
}

fn starts_name(c: char) -> bool {
    c.is_alphabetic() || c == '_'
}

/// The length of a quoted path that begins `text` and ends on its first line.
fn quoted(text: &str) -> Option<usize> {
    let inner = text.strip_prefix('"')?;
    let end = inner.find(['"', '\n'])?;
    inner[end..].starts_with('"').then_some(end + 2)
}

fn name_length(text: &str) -> usize {
    let mut at = 0;
    loop {
        at += match quoted(&text[at..]) {
            Some(length) => length,
            None => text[at..].find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len() - at),
        };
        if !text[at..].starts_with("::") {
            return at;
        }
        at += 2;
        if !text[at..].starts_with(|c| starts_name(c) || c == '"') {
            return at;
        }
    }
}

fn definition_length(text: &str) -> Option<usize> {
    let inner = text.strip_prefix('#')?.trim_start_matches([' ', '\t']).strip_prefix('{')?;
    let end = inner.find(['}', '\n'])?;
    let name = inner.get(..end)?.trim();
    let whole = text.len() - inner.len() + end + 1;
    (inner[end..].starts_with('}') && !name.is_empty() && name.chars().all(|c| c.is_alphanumeric() || c == '_'))
        .then_some(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<&str> {
        tokens(text, 0..text.len()).iter().map(|t| t.text(text)).collect()
    }

    #[test]
    fn words_join_paths_and_keep_definitions() {
        assert_eq!(words("a::b(1.5f) + #{ WG }"), ["a::b", "(", "1.5f", ")", "+", "#{ WG }"]);
        assert_eq!(words("\"lib/a.wgsl\"::{x}"), ["\"lib/a.wgsl\"::", "{", "x", "}"]);
        assert_eq!(words("v.xy é"), ["v", ".", "xy", "é"]);
    }

    #[test]
    fn comments_become_spaces_of_the_same_length() {
        let source = Source::new("a.wgsl", "a // é\nb /* x /* y */ \n z */ c\r\n");
        let mut faults = vec![];
        let text = blank_comments(&source, &mut faults);
        assert_eq!(text, "a      \nb              \n      c \n");
        assert_eq!(text.len(), source.text.len());
        assert_eq!(faults, []);
    }

    #[test]
    fn an_open_comment_is_a_fault_where_it_starts() {
        let source = Source::new("a.wgsl", "a\n /* b");
        let mut faults = vec![];
        blank_comments(&source, &mut faults);
        assert_eq!(format!("{:?}", faults[0].labels[0].0), "a.wgsl:2:2");
    }
}
