//! Which shader a pass runs: its definitions, its composition, and where its text says what.

use super::wire::Wirer;
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, Pass, PassKind};
use crate::graph::expr::Val;
use crate::parallel;
use crate::shader::{Def, Defs, ElementType, Shader};
use std::sync::Arc;

impl<'g> Wirer<'g, '_> {
    /// Composes the shaders of all passes that may run, on all cores: the library keeps them for [`Wirer::shader`],
    /// which finds their faults again.
    pub(super) fn compose_ahead(&mut self) {
        let mut asked: Vec<(&'g str, Defs, Vec<String>)> = vec![];
        self.each_pass_that_may_run(&mut |w, pass, name| {
            let shader = (name.value.as_str(), w.defs(pass, name, &mut vec![]), pass.entries());
            if !asked.contains(&shader) {
                asked.push(shader);
            }
        });
        let texts = self.request.texts;
        parallel::each(0..asked.len(), |i| drop(texts.shader(asked[i].0, &asked[i].1, &asked[i].2)));
    }

    /// Finds the strides of buffers whose elements are structs of shaders.
    pub(super) fn strides(&mut self) {
        if !self.sizes.asks_for_structs() {
            return;
        }
        self.each_pass_that_may_run(&mut |w, pass, name| {
            let defs = w.defs(pass, name, &mut vec![]);
            let Ok(shader) = w.request.texts.shader(&name.value, &defs, &pass.entries()) else { return };
            for v in &shader.interface.variables {
                if let Some((stride, ElementType::Struct(element))) = v.kind.elements() {
                    w.sizes.learn(&pass.target(&v.name).0, element, stride);
                }
            }
        });
    }

    /// Calls `f` with every pass that has a shader and whose condition holds, those in loops and alternatives too.
    fn each_pass_that_may_run(&mut self, f: &mut dyn FnMut(&mut Self, &'g Pass, &'g Name)) {
        let mut open: Vec<&'g Pass> = self.graph().passes.iter().rev().collect();
        while let Some(pass) = open.pop() {
            if pass.when.as_ref().is_some_and(|when| when.truth(&|n| self.value(n)) != Ok(true)) {
                continue;
            }
            match &pass.kind {
                PassKind::Loop { passes, .. } => open.extend(passes.iter().rev()),
                PassKind::Fastest { of, .. } => open.extend(of.iter().flatten().rev()),
                kind => {
                    if let Some(name) = kind.shader() {
                        f(self, pass, name);
                    }
                }
            }
        }
    }

    /// The definitions that a pass gives its shader, as far as the shader asks for them.
    fn defs(&mut self, pass: &'g Pass, name: &'g Name, faults: &mut Vec<Diagnostic>) -> Defs {
        let all = || self.index.mentioned([name.value.as_str()]).into_iter().map(str::to_owned).collect();
        let mentioned = self.mentioned.entry(&name.value).or_insert_with(|| Arc::new(all())).clone();
        let mut defs = Defs::new();
        // A pass of a sub-graph has that one's definitions among its own.
        for (key, e) in self.graph().defines.iter().chain(&pass.defines) {
            let def = match e.eval(&|n| self.value(n)) {
                Ok(Val::Bool(b)) => Some(Def::Bool(b)),
                Ok(Val::Int(i)) => i32::try_from(i).ok().map(Def::Int),
                Ok(_) => None,
                Err(d) => {
                    faults.push(d);
                    continue;
                }
            };
            match def {
                Some(def) if mentioned.contains(&key.value) => drop(defs.insert(key.value.clone(), def)),
                Some(_) => {}
                None => faults.push(
                    Diagnostic::error(format!("`{}` must be a boolean or a 32-bit integer", key.value)).at(&e.span, ""),
                ),
            }
        }
        defs
    }

    pub(super) fn shader(&mut self, pass: &'g Pass, name: &'g Name) -> Option<(usize, Arc<Shader>)> {
        let mut faults = vec![];
        let defs = self.defs(pass, name, &mut faults);
        self.faults.append(&mut faults);
        let wanted = pass.entries();
        let same = |s: &Arc<Shader>| s.path == name.value && s.defs == defs && s.wanted == wanted;
        if let Some(i) = self.out.shaders.iter().position(same) {
            return Some((i, self.out.shaders[i].clone()));
        }
        match self.request.texts.shader(&name.value, &defs, &wanted) {
            Ok(shader) => {
                self.out.shaders.push(shader);
                let i = self.out.shaders.len() - 1;
                Some((i, self.out.shaders[i].clone()))
            }
            Err(faults) => {
                for d in faults.0 {
                    let d = if d.labels.is_empty() { d.at(&name.span, "") } else { d };
                    if !self.faults.contains(&d) {
                        self.faults.push(d);
                    }
                }
                None
            }
        }
    }

    /// Where a shader mentions a word: in its own text first, then in its imports, else in the pass.
    pub(super) fn locate(&self, pass: &Pass, shader: &Shader, word: &str) -> Span {
        let own = std::iter::once(&shader.path).chain(&shader.sources);
        for path in own {
            if let Some(source) = self.request.texts.files.get(path)
                && let Some(at) = self.index.place(path, word)
            {
                return Span::new(source, at..at + word.len());
            }
        }
        pass.kind.shader().map_or_else(|| pass.span.clone(), |n| n.span.clone())
    }
}
