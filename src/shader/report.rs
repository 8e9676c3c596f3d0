//! Checks in shaders: `#import lightgraph::report::{check}`, then `check(holds, invocation, #{HERE})`. The module is
//! part of every project; a shader that does not import it pays nothing.

use super::{Library, Shader};
use crate::diag::{Source, Span};
use std::sync::Arc;

/// The module's path among a project's shaders.
pub const PATH: &str = "lightgraph/report.wgsl";

/// The variable that notes what failed, found by this name.
pub const VARIABLE: &str = "shader_report";

/// The definition that stands for its own place: file and line as one number.
pub(super) const HERE: &str = "HERE";

/// Different lines of one step that can be told apart; `report.wgsl` has the same numbers.
const LINES: usize = 16;
const WORDS: usize = 5;

/// Bytes of [`VARIABLE`].
pub const BYTES: u64 = (4 * LINES * WORDS) as u64;

/// Lines of a file that can be told apart; those behind it count as the last.
const LINE_BITS: u32 = 20;

/// A check that does not hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failed {
    /// Index into [`Shader::sources`].
    file: usize,
    /// From 1.
    line: usize,
    /// In how many invocations.
    pub count: u32,
    /// What the shader gave as the invocation, for the first to say so.
    pub first: [u32; 3],
}

/// The module's text.
pub fn source() -> Arc<Source> {
    Source::new(format!("{}{PATH}", crate::builtin::PREFIX), include_str!("report.wgsl"))
}

/// What [`HERE`] stands for: never 0.
pub(super) fn place(file: usize, line: usize) -> u32 {
    let line = (line as u32).clamp(1, (1 << LINE_BITS) - 1);
    (file as u32) << LINE_BITS | line
}

/// Reads the bytes of [`VARIABLE`] after a run.
pub fn read(bytes: &[u8]) -> Vec<Failed> {
    let word = |at: &[u8]| at.try_into().map_or(0, u32::from_le_bytes);
    let words: Vec<u32> = bytes.chunks_exact(4).map(word).collect();
    let used = words.chunks_exact(WORDS).take_while(|line| line[0] != 0);
    let mut failed: Vec<Failed> = used
        .map(|line| Failed {
            file: (line[0] >> LINE_BITS) as usize,
            line: (line[0] & ((1 << LINE_BITS) - 1)) as usize,
            count: line[1],
            first: [line[2], line[3], line[4]],
        })
        .collect();
    // Which comes first in memory is a matter of chance.
    failed.sort_by_key(|f| (f.file, f.line));
    failed
}

impl Failed {
    /// The line, without the spaces around it, in the texts that the shader was made from.
    pub fn span(&self, shader: &Shader, texts: &Library) -> Option<Span> {
        let source = texts.files.get(shader.sources.get(self.file)?)?;
        let start = source.text.split_inclusive('\n').take(self.line - 1).map(str::len).sum::<usize>();
        let line = source.text.get(start..)?.lines().next()?;
        let start = start + line.len() - line.trim_start().len();
        Some(Span::new(source, start..start + line.trim().len()))
    }
}
