//! `tune`: one pass under several definitions, as alternatives of which the fastest runs.

use super::ast::{Name, Pass, PassKind};
use super::expr::{Expr, item};
use super::read::Reader;
use super::tree::SyntaxNode;
use crate::diag::Diagnostic;

impl Reader {
    /// A pass for each of these lists of definitions, which go before those of the pass. The first of them, as all of
    /// them together, has the pass's name.
    pub(super) fn tuned(&mut self, pass: Pass, tune: &SyntaxNode) -> Pass {
        let ways: Vec<Vec<(Name, Expr)>> = self.list(Some(tune)).iter().map(|n| self.exprs(Some(n))).collect();
        if ways.len() < 2 {
            let d = Diagnostic::error("`tune` has nothing to choose from").at(&tune.span, "");
            self.fault(d.help("give it two lists of definitions or more: `tune: [{…}, {…}]`"));
            return pass;
        }
        let way = |(i, defines): (usize, Vec<(Name, Expr)>)| {
            let mut way = Pass { when: None, ..pass.clone() };
            if i > 0 {
                way.name.value = item(&pass.name.value, i as i64);
            }
            way.defines.retain(|(name, _)| defines.iter().all(|(other, _)| other.value != name.value));
            way.defines.extend(defines);
            vec![way]
        };
        let of = ways.into_iter().enumerate().map(way).collect();
        let (each, only, defines, entry, bind) = (None, None, vec![], vec![], vec![]);
        let (mips, set, kind) = (vec![], vec![], PassKind::Fastest { of, once: true });
        Pass { each, only, defines, entry, bind, mips, set, kind, ..pass.clone() }
    }
}
