//! What a shader file says of itself, under any definitions and however broken: for editors.

use super::{
    imports::Import,
    lex::{self, Token},
    outline::{Outline, outline},
    scan::scan,
};
use crate::diag::Source;
use std::{collections::BTreeSet, ops::Range, sync::Arc};

/// The declarations, imports and words of a file; its faults are left to [`super::compose()`].
#[derive(Debug)]
pub struct Survey {
    /// The text without comments and directives, each byte in its place. Every branch of a condition is kept.
    pub code: String,
    pub words: Vec<Token>,
    /// The name by `#define_import_path`, and where it stands.
    pub module: Option<(String, Range<usize>)>,
    pub imports: Vec<Import>,
    pub outline: Outline,
    /// Definitions that it asks for.
    pub mentioned: BTreeSet<String>,
}

/// Reads a file.
pub fn survey(source: &Arc<Source>) -> Survey {
    let mut faults = vec![];
    let scan = scan(source, None, &mut faults);
    let words = lex::tokens(&scan.text, 0..scan.text.len());
    let outline = outline(source, &scan.text, &words, &mut faults);
    Survey { code: scan.text, words, module: scan.module, imports: scan.imports, outline, mentioned: scan.mentioned }
}
