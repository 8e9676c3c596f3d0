//! Semantic tokens: what the words in the strings of a graph file are, which editors show as text otherwise.

use crate::mentions::GraphFile;
use crate::ron::{TokenShape, WordRole, role, walk};
use crate::text::LineStarts;
use crate::words::provided;
use lsp_types::{SemanticToken, SemanticTokenModifier, SemanticTokenType, SemanticTokens, SemanticTokensLegend};
use std::collections::BTreeMap;
use std::ops::Range;

/// What a word is; the number is its place in the legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    Parameter,
    Variable,
    Property,
    Function,
    Number,
    Operator,
    Keyword,
}

/// The scene or the frame gives it.
const GIVEN: u32 = 1;

pub fn legend() -> SemanticTokensLegend {
    use SemanticTokenType as T;
    SemanticTokensLegend {
        token_types: vec![T::PARAMETER, T::VARIABLE, T::PROPERTY, T::FUNCTION, T::NUMBER, T::OPERATOR, T::KEYWORD],
        token_modifiers: vec![SemanticTokenModifier::DEFAULT_LIBRARY],
    }
}

/// The tokens of a graph file in the protocol's words: each by its distance from the one before.
pub fn tokens(lines: &LineStarts) -> SemanticTokens {
    let mut data: Vec<SemanticToken> = vec![];
    let (mut line, mut column) = (0, 0);
    for (range, what, token_modifiers_bitset) in found(lines) {
        let place = lines.range(&range);
        let delta_line = place.start.line - line;
        let delta_start = if delta_line == 0 { place.start.character - column } else { place.start.character };
        (line, column) = (place.start.line, place.start.character);
        data.push(SemanticToken {
            delta_line,
            delta_start,
            length: place.end.character.saturating_sub(place.start.character),
            token_type: what as u32,
            token_modifiers_bitset,
        });
    }
    SemanticTokens { result_id: None, data }
}

/// In the order of the text.
fn found(lines: &LineStarts) -> Vec<(Range<usize>, What, u32)> {
    let file = GraphFile::new(&lines.source);
    let sections: BTreeMap<&str, &str> = file.declared.iter().map(|d| (d.name.as_str(), d.section)).collect();
    let named = |name: &str| match sections.get(name) {
        Some(&"params") => (What::Parameter, 0),
        Some(_) => (What::Variable, 0),
        None if provided(name).is_some() => (What::Variable, GIVEN),
        None => (What::Variable, 0),
    };
    let mut found = vec![];
    walk(&lines.source.text, &mut |token, frames| {
        if token.shape != TokenShape::Text || token.text.contains('\n') {
            return;
        }
        let start = token.range.start;
        match role(frames, token.shape, token.key) {
            WordRole::Expression => {
                for (range, what) in words(token.text) {
                    // `grid.x` is a part of what is declared as `grid`.
                    let word = &token.text[range.clone()];
                    let (what, modifiers) = match what {
                        What::Variable => named(if sections.contains_key(word) { word } else { root(word) }),
                        other => (other, 0),
                    };
                    found.push((start + range.start..start + range.end, what, modifiers));
                }
            }
            WordRole::Names if !token.text.is_empty() => {
                let (what, modifiers) = named(token.text);
                found.push((token.range.clone(), what, modifiers));
            }
            WordRole::Variable if !token.text.is_empty() => found.push((token.range.clone(), What::Property, 0)),
            _ => {}
        }
    });
    found
}

fn root(name: &str) -> &str {
    name.split('.').next().unwrap_or(name)
}

/// The words of an expression. A name is a variable here, whatever it is declared as.
fn words(text: &str) -> Vec<(Range<usize>, What)> {
    let mut found = vec![];
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let part = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let name = c.is_alphabetic() || c == '_';
        let length = match name || c.is_ascii_digit() {
            true => text[at..].find(|c| !part(c)).unwrap_or(text.len() - at),
            false => c.len_utf8(),
        };
        let range = at..at + length;
        let call = text[range.end..].trim_start().starts_with('(');
        match c {
            _ if name && matches!(&text[range.clone()], "true" | "false") => found.push((range, What::Keyword)),
            _ if name && call => found.push((range, What::Function)),
            _ if name => found.push((range, What::Variable)),
            _ if c.is_ascii_digit() => found.push((range, What::Number)),
            '+' | '-' | '*' | '/' | '%' | '<' | '>' | '=' | '!' | '&' | '|' | '?' | ':' => {
                found.push((range, What::Operator));
            }
            _ => {}
        }
        at += length;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::text::ColumnUnit;
    use lightgraph::internals::diag::Source;

    #[test]
    fn words_in_strings_are_told_apart() {
        let text = r#"Graph(params: {"p": Uint(default: 2)},
            lets: {"n": "max(p, 2) + camera_position.x ? true : grid.y"},
            passes: [Screen(name: "s", bind: {"v": "r"})], about: "p + 2")"#;
        let lines = LineStarts::new(&Source::new("a.ron", text), ColumnUnit::Utf16);
        let all: Vec<(&str, What, u32)> = found(&lines).into_iter().map(|(r, w, m)| (&text[r], w, m)).collect();
        let expected = [
            ("max", What::Function, 0),
            ("p", What::Parameter, 0),
            ("2", What::Number, 0),
            ("+", What::Operator, 0),
            ("camera_position.x", What::Variable, GIVEN),
            ("?", What::Operator, 0),
            ("true", What::Keyword, 0),
            (":", What::Operator, 0),
            ("grid.y", What::Variable, 0),
            ("v", What::Property, 0),
            ("r", What::Variable, 0),
        ];
        assert_eq!(all, expected);
    }

    #[test]
    fn tokens_are_told_by_their_distances() {
        let text = "Graph(lets: {\n    \"é\": \"1 +\u{1F600} x\",\n    \"b\": \"é\",\n})";
        let lines = LineStarts::new(&Source::new("a.ron", text), ColumnUnit::Utf16);
        let data = tokens(&lines).data;
        let (mut line, mut column) = (0, 0);
        for (token, (range, ..)) in data.iter().zip(found(&lines)) {
            column = if token.delta_line == 0 { column } else { 0 } + token.delta_start;
            line += token.delta_line;
            assert_eq!(lines.byte(lsp_types::Position::new(line, column)), range.start);
        }
        assert_eq!(data.len(), 4);
    }
}
