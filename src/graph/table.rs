//! `Table(of: …)`: columns of a table of the scene, as texels.

use super::ast::{Name, ResourceDecl, ResourceKind};
use super::read::{Fields, Reader};
use super::tree::SyntaxNode;
use crate::diag::Diagnostic;
use crate::scene;

impl Reader {
    /// `Table(of: "bvh", columns: ["lower", "first"])`.
    pub(super) fn table(&mut self, node: &SyntaxNode, mut f: Fields) -> Option<ResourceDecl> {
        let of = self.need(&mut f, "of").and_then(|n| self.name(n));
        let list = self.need(&mut f, "columns");
        let columns: Vec<Name> = self.list(list).iter().filter_map(|n| self.name(n)).collect();
        self.finish(&f);
        let (of, list) = (of?, list?);
        let Some(table) = scene::table(&of.value) else {
            let d = Diagnostic::error(format!("the scene has no table `{}`", of.value)).at(&of.span, "");
            self.fault(d.nearest(&of.value, scene::TABLES.iter().map(|t| t.name)));
            return None;
        };
        let names = || table.columns.iter().map(|c| c.0);
        if columns.is_empty() {
            let d = Diagnostic::error(format!("no column of `{}` is named", of.value)).at(&list.span, "");
            self.fault(d.help(format!("columns: {}", names().collect::<Vec<_>>().join(", "))));
        }
        for (i, column) in columns.iter().enumerate() {
            if !names().any(|name| name == column.value) {
                let what = format!("the table `{}` has no column `{}`", of.value, column.value);
                self.fault(Diagnostic::error(what).at(&column.span, "").nearest(&column.value, names()));
            } else if let Some(first) = columns[..i].iter().find(|c| c.value == column.value) {
                let d = Diagnostic::error(format!("the column `{}` is named twice", column.value));
                self.fault(d.at(&column.span, "").at(&first.span, "first here"));
            }
        }
        Some(ResourceDecl {
            span: node.span.clone(),
            kind: ResourceKind::Table { of, columns },
            history: false,
            initial: None,
            members: None,
            min: None,
            max: None,
        })
    }
}
