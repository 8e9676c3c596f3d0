//! Faults in the words of the protocol.

use crate::text::{ColumnUnit, LineStarts};
use crate::uri;
use lightgraph::Diagnostic;
use lightgraph::internals::diag::{Severity, Source, Span};
use lsp_types::{DiagnosticRelatedInformation, DiagnosticSeverity, Location, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What stands before each remedy in a message.
pub const HELP: &str = "help: ";

/// Turns faults into the protocol's; the lines of each text are counted once.
pub struct ProtocolFaults {
    columns: ColumnUnit,
    lines: Vec<LineStarts>,
}

impl ProtocolFaults {
    pub fn new(columns: ColumnUnit) -> ProtocolFaults {
        ProtocolFaults { columns, lines: vec![] }
    }

    /// The file of a fault of a graph, and the fault. One without a place in a file stands at the start of the graph.
    pub fn diagnostic(&mut self, graph: &Path, d: &Diagnostic) -> (PathBuf, lsp_types::Diagnostic) {
        let mut message = d.message.clone();
        let (path, range) = match d.labels.first() {
            Some((span, label)) if uri::of(Path::new(&span.source.path)).is_some() => {
                if !label.is_empty() {
                    message = format!("{message}\n{label}");
                }
                (PathBuf::from(&span.source.path), self.range(span))
            }
            Some((span, label)) => {
                // A file that the program carries: no editor can open it.
                let (line, column) = span.source.line_column(span.start);
                message = format!("{message}\n{}:{line}:{column} {label}", span.source.path);
                (graph.to_path_buf(), Range::default())
            }
            None => (graph.to_path_buf(), Range::default()),
        };
        for help in &d.help {
            message = format!("{message}\n{HELP}{help}");
        }
        let related: Vec<_> = d.labels.iter().skip(1).filter_map(|(span, label)| self.related(span, label)).collect();
        let severity = match d.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Note => DiagnosticSeverity::INFORMATION,
        };
        let told = lsp_types::Diagnostic {
            range,
            severity: Some(severity),
            source: Some("lightgraph".into()),
            message,
            related_information: Some(related).filter(|r| !r.is_empty()),
            ..lsp_types::Diagnostic::default()
        };
        (path, told)
    }

    fn related(&mut self, span: &Span, label: &str) -> Option<DiagnosticRelatedInformation> {
        let uri = uri::of(Path::new(&span.source.path))?;
        let message = if label.is_empty() { "this, too".into() } else { label.into() };
        Some(DiagnosticRelatedInformation { location: Location { uri, range: self.range(span) }, message })
    }

    pub fn range(&mut self, span: &Span) -> Range {
        self.lines(&span.source).range(&(span.start..span.end))
    }

    pub fn lines(&mut self, source: &Arc<Source>) -> &LineStarts {
        let at = self.lines.iter().position(|l| Arc::ptr_eq(&l.source, source)).unwrap_or_else(|| {
            self.lines.push(LineStarts::new(source, self.columns));
            self.lines.len() - 1
        });
        &self.lines[at]
    }
}
