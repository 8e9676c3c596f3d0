//! Chooses the shader of each pass and what it is given: evaluates its definitions, composes it, locates words in its
//! text, and resolves the members of its uniforms by name. Also holds the shaders of the planner's own steps, which are
//! the same for all plans and composed once.

use super::wire::{Wired, Wirer};
use super::{Binding, Desc};
use crate::diag::{Checked, Diagnostic, Source, Span};
use crate::graph::ast::{Name, Pass, PassKind, ResourceKind};
use crate::graph::expr::Val;
use crate::parallel;
use crate::scene::FRAME_VALUES;
use crate::shader::{Def, Defs, ElementType, Layout, Library, Shader, compose};
use crate::value::{Type, Value, Values};
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

impl<'g> Wirer<'g, '_> {
    /// A uniform's members, each a value by name. A renamed plain value asks for its new name.
    pub(super) fn uniform(
        &mut self,
        wired: &Wired<'g>,
        shader: &Shader,
        layout: &Arc<Layout>,
        variable: &str,
        target: &str,
    ) -> Option<Binding> {
        let mut extra = self.atlas_facts(wired, shader);
        extra.extend(self.set_values(wired));
        let indices = wired.pass.indices.iter();
        let index = |name: &str| indices.clone().rev().find(|(n, _)| n == name).map(|(_, i)| Value::Uint(*i));
        let pass = wired.pass;
        let whole = |name: &str| match name {
            name if extra.contains_key(name) || name == "member" => None,
            name if name == variable => Some(target.to_string()),
            name => Some(pass.target(name).0),
        };
        let mut layout = layout.clone();
        for (i, new) in layout.members.iter().map(|m| whole(&m.name)).enumerate().collect::<Vec<_>>() {
            if let Some(new) = new.filter(|new| *new != layout.members[i].name) {
                Arc::make_mut(&mut layout).members[i].name = new;
            }
        }
        let mut good = true;
        for m in &layout.members {
            if m.name == "member" && wired.each.is_some() {
                extra.insert("member".into(), Value::Uint(0));
            }
            if let Some(index) = index(&m.name).filter(|_| !extra.contains_key(&m.name)) {
                extra.insert(m.name.clone(), index);
            }
            let ty = extra.get(&m.name).or_else(|| self.values.get(&m.name)).map(|v| (v.ty(), v.cast(m.ty).is_some()));
            let ty = ty.or_else(|| wired.loops.contains(&m.name).then_some((Type::Uint, castable(Type::Uint, m.ty))));
            let frame = || FRAME_VALUES.iter().find(|f| f.0 == m.name).map(|f| (f.1, castable(f.1, m.ty)));
            match ty.or_else(frame) {
                Some((_, true)) => {}
                Some((ty, false)) => {
                    let d = Diagnostic::error(format!(
                        "`{}` is of type {}, the shader wants {}",
                        m.name,
                        ty.wgsl(),
                        m.ty.wgsl()
                    ));
                    let span = self.locate(wired.pass, shader, &m.name);
                    self.faults.push(d.at(&span, ""));
                    good = false;
                }
                None => {
                    let span = self.locate(wired.pass, shader, &m.name);
                    let d = Diagnostic::error(format!("no parameter or value is called `{}`", m.name)).at(&span, "");
                    let names = self.values.keys().map(String::as_str).chain(FRAME_VALUES.iter().map(|f| f.0));
                    let names: Vec<&str> = names.chain(wired.loops.iter().map(String::as_str)).collect();
                    let d = d.nearest(&m.name, names);
                    if !self.faults.contains(&d) {
                        self.faults.push(d);
                    }
                    good = false;
                }
            }
        }
        extra.retain(|name, _| layout.members.iter().any(|m| m.name == *name));
        good.then_some(Binding::Uniform { layout, extra })
    }

    /// What a pass sets by itself.
    fn set_values(&mut self, wired: &Wired<'g>) -> Values {
        let mut values = Values::new();
        for (name, e) in &wired.pass.set {
            let value = e.eval(&|n| self.value(n)).and_then(|v| {
                let fault = || Diagnostic::error(format!("`{}` doesn't fit 32 bits", name.value)).at(&e.span, "");
                v.to_value().ok_or_else(fault)
            });
            if let Some(value) = self.keep(value) {
                values.insert(name.value.clone(), value);
            }
        }
        values
    }

    /// `v_tile`, `v_columns`, `v_count` of the atlases bound to variables.
    fn atlas_facts(&self, wired: &Wired<'g>, shader: &Shader) -> Values {
        let mut facts = Values::new();
        for v in &shader.interface.variables {
            let target = wired.pass.target(&v.name).0;
            let resource = match &wired.pass.kind {
                PassKind::Reduce { from, .. } if v.name == "source" => &from.value,
                PassKind::Reduce { to, .. } if v.name == "result" => &to.value,
                _ => &target,
            };
            let atlas = self.sizes.declared(resource).is_some_and(|r| matches!(r.kind, ResourceKind::Atlas { .. }));
            if atlas
                && let Some(Ok(sized)) = self.sizes.of(resource)
                && let Desc::Texture(t) = &sized.desc
                && let Some(tiles) = t.tiles
            {
                for (suffix, n) in [("tile", tiles.edge), ("columns", tiles.columns), ("count", tiles.count)] {
                    facts.insert(format!("{}_{suffix}", v.name), Value::Uint(n));
                }
            }
        }
        facts
    }
}

/// Whether a uniform may hold a value of another type, converted.
pub(super) fn castable(from: Type, to: Type) -> bool {
    from == to
        || matches!(
            (from, to),
            (Type::Bool, Type::Uint | Type::Int)
                | (Type::Uint, Type::Int | Type::Float)
                | (Type::Int, Type::Uint | Type::Float)
                | (Type::UVec2, Type::Vec2)
                | (Type::UVec3, Type::Vec3)
        )
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
