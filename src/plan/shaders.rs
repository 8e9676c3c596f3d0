//! Chooses the shader of each pass: evaluates its definitions, composes it, and locates words in its text. Also holds
//! the shaders of the planner's own steps, which are the same for all plans and composed once.

use super::wire::Wirer;
use crate::diag::{Checked, Diagnostic, Source, Span};
use crate::graph::ast::{Name, Pass, PassKind};
use crate::graph::expr::Val;
use crate::parallel;
use crate::shader::{Def, Defs, ElementType, Library, Shader, compose};
use std::sync::{Arc, Mutex, PoisonError};

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
            if let Some(at) = self.index.place(path, word)
                && let Some(source) = self.request.texts.files.get(path)
            {
                return Span::new(source, at..at + word.len());
            }
        }
        pass.kind.shader().map_or_else(|| pass.span.clone(), |n| n.span.clone())
    }
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BuiltIn {
    /// Fills a buffer of draws with what members see.
    Cull,
    /// Bounds what a pass takes from a buffer of counts.
    Bound,
    /// A stage of prefix sums, of integers or of floats.
    Scan(ScanStage, bool),
}

/// The stages of prefix sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ScanStage {
    /// The sum of each block.
    AddUp,
    /// What comes before each block.
    Before,
    /// The sums of each block's elements.
    Place,
    /// The same of a single block.
    Alone,
}

impl BuiltIn {
    /// Its file and entry point. The path can't be that of a file of a graph.
    fn file(self) -> (&'static str, &'static str, &'static str) {
        const SCAN: (&str, &str) = ("built-in: scan.wgsl", include_str!("scan.wgsl"));
        let ((path, text), entry) = match self {
            BuiltIn::Cull => (("built-in: cull.wgsl", include_str!("cull.wgsl")), "cull"),
            BuiltIn::Bound => (("built-in: bound.wgsl", include_str!("bound.wgsl")), "bound"),
            BuiltIn::Scan(ScanStage::AddUp, _) => (SCAN, "add_up"),
            BuiltIn::Scan(ScanStage::Before, _) => (SCAN, "come_before"),
            BuiltIn::Scan(ScanStage::Place, _) => (SCAN, "place"),
            BuiltIn::Scan(ScanStage::Alone, _) => (SCAN, "place_alone"),
        };
        (path, text, entry)
    }

    fn compose(self) -> Checked<Arc<Shader>> {
        let (path, text, entry) = self.file();
        let mut library = Library::default();
        library.files.insert(path.into(), Source::new(path, text));
        let floats = matches!(self, BuiltIn::Scan(_, true));
        let defs: Defs = floats.then(|| ("FLOATS".to_string(), Def::Bool(true))).into_iter().collect();
        compose(&library, path, &defs, &[entry.into()]).map(Arc::new)
    }

    fn shader(self) -> Checked<Arc<Shader>> {
        type Made = Vec<(BuiltIn, Checked<Arc<Shader>>)>;
        static MADE: Mutex<Made> = Mutex::new(vec![]);
        let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, shader)) = made.iter().find(|(known, _)| *known == self) {
            return shader.clone();
        }
        let shader = self.compose();
        made.push((self, shader.clone()));
        shader
    }
}

impl Wirer<'_, '_> {
    /// The shader and its index among the plan's.
    pub(super) fn built_in(&mut self, which: BuiltIn) -> Option<(usize, Arc<Shader>)> {
        let shader = which.shader().map_err(|f| self.faults.extend(f.0)).ok()?;
        let there = self.out.shaders.iter().position(|s| Arc::ptr_eq(s, &shader));
        let index = there.unwrap_or_else(|| {
            self.out.shaders.push(shader.clone());
            self.out.shaders.len() - 1
        });
        Some((index, shader))
    }
}
