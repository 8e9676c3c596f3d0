//! `Image(file: …)`: a texture that files hold. They are read with the graph that names them.

use super::ast::{ResourceDecl, ResourceKind};
use super::read::{Fields, Reader};
use super::tree::{SyntaxKind, SyntaxNode};
use crate::builtin;
use crate::diag::{Diagnostic, Span};
use crate::files;
use crate::image::texture::{self, Coding, Wanted};
use std::path::{Path, PathBuf};

/// Bytes of all images of a graph at most, unpacked.
const MOST_BYTES: u64 = 1 << 30;

impl Reader {
    pub(super) fn image(&mut self, node: &SyntaxNode, mut f: Fields) -> Option<ResourceDecl> {
        let before = self.faults.len();
        let place = self.need(&mut f, "file");
        let files = place.map(|n| match &n.kind {
            SyntaxKind::List(names) => names.iter().filter_map(|n| self.image_file(n)).collect(),
            _ => self.image_file(n).into_iter().collect::<Vec<_>>(),
        });
        let codings = [("Linear", Some(Coding::Linear)), ("Srgb", Some(Coding::Srgb))];
        let coding = self.word(f.get("color"), &codings, None);
        let format = f.get("format").and_then(|n| self.format(n));
        let mips = self.bool(f.get("mips"), false);
        let face = f.get("face").and_then(|n| self.whole(n));
        self.finish(&f);
        let (files, spans): (Vec<PathBuf>, Vec<Span>) = files?.into_iter().unzip();
        if self.faults.len() > before {
            return None;
        }
        let around = place.map_or(&node.span, |n| &n.span);
        let image = match texture::read(&Wanted { files: files.clone(), coding, format, mips, face }) {
            Ok(image) => image,
            Err((i, d)) => {
                self.fault(d.at(spans.get(i).unwrap_or(around), ""));
                return None;
            }
        };
        self.image_bytes += image.bytes();
        self.images.extend(files);
        if self.image_bytes > MOST_BYTES {
            let d = Diagnostic::error(format!("the images of the graph take more than {} MiB", MOST_BYTES >> 20));
            self.fault(d.at(around, "with this one").help("make them smaller, or give them a smaller `format`"));
            return None;
        }
        Some(ResourceDecl {
            span: node.span.clone(),
            kind: ResourceKind::Image(image),
            history: false,
            initial: None,
            members: None,
            min: None,
            max: None,
        })
    }

    /// A file in the folder of the text that names it, or below, or one that the program carries.
    fn image_file(&mut self, node: &SyntaxNode) -> Option<(PathBuf, Span)> {
        let name = self.text(node)?;
        let folder = Path::new(&name.span.source.path).parent().unwrap_or(Path::new(""));
        let path = builtin::join(folder, &name.value);
        if !builtin::is_builtin(&path)
            && let Err(why) = files::inside(folder, &name.value)
        {
            let d = Diagnostic::error("an image must lie in the folder of the graph that names it or below it");
            self.fault(d.at(&name.span, format!("this {why}")));
            return None;
        }
        Some((path, name.span))
    }

    /// A whole number.
    fn whole(&mut self, node: &SyntaxNode) -> Option<u32> {
        let number = node.word().and_then(|w| w.parse().ok());
        if number.is_none() {
            self.fault(Diagnostic::error("expected a whole number").at(&node.span, ""));
        }
        number
    }
}
