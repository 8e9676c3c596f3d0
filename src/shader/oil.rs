//! naga_oil: several files to one naga module, and its errors to places in the files.
//!
//! naga_oil sees texts without comments, directives or definitions, in which every imported name is spelt
//! `module::item`; what is left to it is to join the modules. A composer forgets all modules before each shader, as one
//! that has seen another version of a file attributes errors to the wrong one.

use super::{
    link::LinkUnit,
    write::{Written, declared_at, module_name, plain},
};
use crate::caught::caught;
use crate::diag::{Checked, Diagnostic, Span};
use naga::valid::ValidationError;
use naga_oil::compose::{
    ComposableModuleDescriptor, Composer, ComposerError, ComposerErrorInner, ErrSource, NagaModuleDescriptor,
};
use std::{error::Error, ops::Range};

/// What shaders may use: what every Vulkan device of the last years has, storage formats included.
/// A plan refuses views where the adapter has none.
pub(super) fn capabilities() -> naga::valid::Capabilities {
    use naga::valid::Capabilities as C;
    C::default() | C::STORAGE_TEXTURE_16BIT_NORM_FORMATS | C::MULTIVIEW
}

/// naga_oil's composer. It compiles a dozen regular expressions when it is made: that takes longer than to join a
/// shader.
#[derive(Debug)]
pub(super) struct Oil(Composer);

impl Default for Oil {
    fn default() -> Oil {
        Oil(Composer::default().with_capabilities(capabilities()))
    }
}

impl Oil {
    /// A composer that has seen no module.
    fn fresh(&mut self) -> &mut Composer {
        self.0.module_sets.clear();
        self.0.module_index.clear();
        &mut self.0
    }
}

/// Joins the units; the last is the shader's own file. The module is valid, its bindings are placeholders.
///
/// # Errors
/// The first parse error of a file, or the first validation error.
pub(super) fn join(oil: &mut Oil, units: &[LinkUnit], written: &[Written]) -> Checked<naga::Module> {
    let joiner = Joiner { units, written };
    // naga_oil unwraps here and there; a user's text must not end the program when it finds such a place.
    match caught(|| joiner.join(oil.fresh())) {
        Some(result) => result.map_err(Into::into),
        None => Err(joiner
            .fault("naga_oil gave up on this shader", vec![])
            .help("undo the last change to it or to what it imports")
            .into()),
    }
}

/// A span counts bytes in its low 21 bits, and the module in the others.
const SPAN_SHIFT: usize = 21;

/// How naga begins a label that has no words for a user.
const NAGA_TYPE: &str = "naga::";

struct Joiner<'a> {
    units: &'a [LinkUnit],
    written: &'a [Written],
}

impl Joiner<'_> {
    fn join(&self, composer: &mut Composer) -> Result<naga::Module, Diagnostic> {
        let (Some((root, modules)), Some(root_written)) = (self.units.split_last(), self.written.last()) else {
            return Ok(naga::Module::default());
        };
        for (index, (unit, written)) in modules.iter().zip(self.written).enumerate() {
            composer
                .add_composable_module(ComposableModuleDescriptor {
                    source: &written.text,
                    file_path: &unit.path,
                    as_name: Some(module_name(index)),
                    ..Default::default()
                })
                .map_err(|e| self.diagnostic(&e))?;
        }
        composer
            .make_naga_module(NagaModuleDescriptor {
                source: &root_written.text,
                file_path: &root.path,
                ..Default::default()
            })
            .map_err(|e| self.diagnostic(&e))
    }

    /// A fault at the start of the shader's own file when there is no better place.
    fn fault(&self, message: impl Into<String>, labels: Vec<(Span, String)>) -> Diagnostic {
        let mut fault = Diagnostic::error(message);
        fault.labels = labels;
        if let (true, Some(root)) = (fault.labels.is_empty(), self.units.last()) {
            fault = fault.at(&Span::new(&root.source, 0..0), "");
        }
        fault
    }

    fn diagnostic(&self, error: &ComposerError) -> Diagnostic {
        let (unit, offset) = match &error.source {
            ErrSource::Module { name, offset, .. } => {
                let unit = (0..self.units.len()).find(|i| module_name(*i) == *name);
                (unit.unwrap_or(self.units.len().saturating_sub(1)), *offset)
            }
            ErrSource::Constructing { offset, .. } => (self.units.len().saturating_sub(1), *offset),
        };
        match &error.inner {
            ComposerErrorInner::WgslParseError(e) => {
                let labels = e
                    .labels()
                    .filter_map(|(span, text)| Some((self.place(unit, offset, span.to_range()?)?, plain(text))));
                let mut fault = self.fault(plain(e.message()), labels.collect());
                fault.help = e.notes().map(plain).collect();
                fault
            }
            ComposerErrorInner::ShaderValidationError(e) => {
                let root = self.units.len().saturating_sub(1);
                let labels = e.spans().filter_map(|(span, text)| {
                    let range = span.to_range()?;
                    // Module 0 is the shader's own file, which stands last among the units.
                    let module = (range.start >> SPAN_SHIFT).checked_sub(1).unwrap_or(root);
                    // The offset is that of one module; places in others can't be led back.
                    let place = self.place(unit, offset, range).filter(|_| module == unit)?;
                    Some((place, tidy(text)))
                });
                let mut labels: Vec<(Span, String)> = labels.collect();
                // Labels with nothing but the name of a naga type frame what others point at.
                if labels.iter().any(|(_, text)| !text.starts_with(NAGA_TYPE)) {
                    labels.retain(|(_, text)| !text.starts_with(NAGA_TYPE));
                }
                labels.sort_by_key(|(span, _)| span.end - span.start);
                for (_, text) in labels.iter_mut().filter(|(_, text)| text.starts_with(NAGA_TYPE)) {
                    text.clear();
                }
                self.invalid(e.as_inner(), labels)
            }
            // The places of header errors lie in texts that naga_oil made up; the names don't.
            ComposerErrorInner::HeaderValidationError(e) => self.invalid(e.as_inner(), vec![]),
            ComposerErrorInner::InvalidIdentifier { original, at } => {
                let labels = at.to_range().and_then(|r| self.place(unit, offset, r)).map(|p| (p, String::new()));
                let message = format!("`{}` can't be exported from a module", plain(original));
                let help = "use plain letters, digits and single `_`, and no name that begins with `_naga`";
                self.fault(message, labels.into_iter().collect()).help(help)
            }
            other => {
                let labels = self.units.get(unit).map(|u| (Span::new(&u.source, 0..0), String::new()));
                self.fault(tidy(&other.to_string()), labels.into_iter().collect())
            }
        }
    }

    /// A validation error; without labels it is placed at the declaration that it names.
    fn invalid(&self, error: &ValidationError, mut labels: Vec<(Span, String)>) -> Diagnostic {
        if labels.is_empty() {
            let place = subject(error).and_then(|name| declared_at(self.units, name));
            labels.extend(place.map(|place| (place, String::new())));
        }
        let fault = self.fault(chain(error), labels);
        match advice(&fault.message) {
            Some(help) => fault.help(help),
            None => fault,
        }
    }

    /// Where bytes of what naga parsed lie in the source; `None` for the header of imported names.
    fn place(&self, unit: usize, offset: usize, range: Range<usize>) -> Option<Span> {
        let low = (1 << SPAN_SHIFT) - 1;
        let start = (range.start & low).checked_sub(offset)?;
        let end = (range.end & low).saturating_sub(offset).max(start);
        let source = &self.units.get(unit)?.source;
        Some(Span::new(source, self.written.get(unit)?.back(start..end)))
    }
}

/// The name, as naga_oil decorates it, of what is invalid.
fn subject(error: &ValidationError) -> Option<&str> {
    match error {
        ValidationError::Type { name, .. }
        | ValidationError::Constant { name, .. }
        | ValidationError::Override { name, .. }
        | ValidationError::GlobalVariable { name, .. }
        | ValidationError::Function { name, .. }
        | ValidationError::EntryPoint { name, .. } => Some(name),
        _ => None,
    }
}

/// An error and its causes in one line.
fn chain(error: &dyn Error) -> String {
    let mut parts = vec![error.to_string()];
    let mut cause = error.source();
    while let Some(e) = cause {
        parts.push(e.to_string());
        cause = e.source();
    }
    tidy(&parts.join(": ")).replace("Call to is invalid", "A call is invalid")
}

/// naga's words without decorations and without the numbers of its arenas (`[12]`), which mean nothing to a user.
pub(super) fn tidy(text: &str) -> String {
    let text = plain(text);
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find(" [") {
        let tail = &rest[at + 2..];
        let digits = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
        if digits > 0 && tail[digits..].starts_with(']') {
            out.push_str(&rest[..at]);
            rest = &tail[digits + 1..];
        } else {
            out.push_str(&rest[..at + 2]);
            rest = tail;
        }
    }
    out + rest
}

/// What to do about a validation error whose words don't say.
fn advice(message: &str) -> Option<&'static str> {
    if message.contains("HOST_SHAREABLE") || message.contains("host-shareable") {
        Some("a `bool` can't be shared with the host: use `u32`, which is 0 or 1")
    } else if message.contains("orkgroup") && message.contains("size") {
        Some("a workgroup has at least one invocation along each axis")
    } else {
        None
    }
}
