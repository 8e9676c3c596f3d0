//! Passes to wired passes: conditions decided, shaders composed, every variable bound by name and checked.

use super::request::{self, Request};
use super::sizes::Sizes;
use super::{Binding, Comparison, Desc, TableUse, TextureKind};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Graph, Name, Pass, PassKind, Raster, ResourceKind};
use crate::graph::expr::{Binary, ExprKind, Val};
use crate::scene::{FRAME_VALUES, TABLES};
use crate::shader::{
    Access, BindingKind, Def, Defs, Layout, Output, OutputKind, Shader, Stage, TextureDim, TextureSample, Variable,
    compose, mentioned_defs,
};
use crate::value::{Type, Value, Values};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A pass that runs, or a loop over such.
pub enum Item<'g> {
    Pass(Wired<'g>),
    Loop { pass: &'g Pass, count: u32, until: Option<(String, Comparison, f32)>, body: Vec<Item<'g>> },
}

/// A pass with everything it touches.
pub struct Wired<'g> {
    pub pass: &'g Pass,
    /// Index into the plan's shaders.
    pub shader: Option<usize>,
    pub each: Option<u32>,
    pub uses: Vec<Use>,
    /// Colour targets: location, resource.
    pub color: Vec<(u32, String)>,
    /// Bindings that do not depend on the member, or the name of the resource.
    pub bindings: Vec<Wire>,
    /// Names of the loops around it, outermost first.
    pub loops: Vec<String>,
}

/// What a shader's variable is bound to, before resources have ids.
pub enum Wire {
    Resource(String),
    /// A variable that a reduction binds itself.
    Source,
    Target,
    Fixed(Binding),
}

/// One use of a resource by a pass.
#[derive(Debug, Clone)]
pub struct Use {
    pub resource: String,
    pub mode: Mode,
    pub how: How,
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Only its size is asked for.
    Size,
    Read,
    /// All of it is overwritten.
    Write,
    /// Some of it may be overwritten; nothing is read.
    Partial,
    ReadWrite,
}

impl Mode {
    pub fn reads(self) -> bool {
        matches!(self, Mode::Read | Mode::ReadWrite)
    }
    pub fn writes(self) -> bool {
        matches!(self, Mode::Write | Mode::Partial | Mode::ReadWrite)
    }
}

/// By what way a resource is used; decides the usages it is allocated with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    Sampled,
    Storage,
    Target,
    CopySource,
    CopyTarget,
    Cleared,
}

/// The result: items in the order of the file, and what was left out.
pub struct Wiring<'g> {
    pub items: Vec<Item<'g>>,
    pub shaders: Vec<Arc<Shader>>,
    pub tables: Vec<TableUse>,
    /// Passes left out by their condition, and why.
    pub off: Vec<(&'g Pass, String)>,
}

/// Wires all passes whose conditions hold.
pub fn wire<'g>(
    request: &'g Request<'g>,
    values: &'g Values,
    sizes: &'g Sizes<'g>,
    faults: &mut Vec<Diagnostic>,
) -> Wiring<'g> {
    let mut w = Wirer {
        request,
        values,
        sizes,
        faults,
        out: Wiring { items: vec![], shaders: vec![], tables: vec![], off: vec![] },
    };
    let items = w.passes(&request.graph.passes, &[]);
    w.out.items = items;
    w.out
}

struct Wirer<'g, 'f> {
    request: &'g Request<'g>,
    values: &'g Values,
    sizes: &'g Sizes<'g>,
    faults: &'f mut Vec<Diagnostic>,
    out: Wiring<'g>,
}

impl<'g> Wirer<'g, '_> {
    fn value(&self, name: &str) -> Option<Val> {
        self.values.get(name).map(|v| Val::from(*v))
    }

    fn keep<T>(&mut self, result: Result<T, Diagnostic>) -> Option<T> {
        result.map_err(|d| self.faults.push(d)).ok()
    }

    fn graph(&self) -> &'g Graph {
        self.request.graph
    }

    fn passes(&mut self, passes: &'g [Pass], loops: &[String]) -> Vec<Item<'g>> {
        let mut items = vec![];
        for pass in passes {
            if let Some(when) = &pass.when {
                let on = when.truth(&|n| self.value(n));
                match self.keep(on) {
                    Some(true) => {}
                    Some(false) => {
                        self.out.off.push((pass, format!("`{}` is false", when.span.text())));
                        continue;
                    }
                    None => continue,
                }
            }
            match &pass.kind {
                PassKind::Loop { count, until, passes } => {
                    let n = request::count(count, self.values, "a loop's count");
                    let Some(n) = self.keep(n) else { continue };
                    if n == 0 {
                        self.out.off.push((pass, format!("`{}` is 0", count.span.text())));
                        continue;
                    }
                    if n > LONGEST_LOOP {
                        let d = Diagnostic::error(format!("a loop of {n} iterations")).at(&count.span, "");
                        self.faults.push(d.help(format!("the most is {LONGEST_LOOP}")));
                        continue;
                    }
                    let until = until.as_ref().and_then(|e| self.until(e));
                    let mut inner = loops.to_vec();
                    inner.push(pass.name.value.clone());
                    let body = self.passes(passes, &inner);
                    if let Some((buffer, ..)) = &until
                        && !any_use(&body, &mut |u| u.resource == *buffer && u.mode.writes())
                    {
                        let d = Diagnostic::error(format!(
                            "nothing in the loop writes `{buffer}`, so it would never end early"
                        ));
                        let span = match &pass.kind {
                            PassKind::Loop { until: Some(e), .. } => &e.span,
                            _ => &pass.span,
                        };
                        self.faults.push(d.at(span, "").help("write it in the loop, or leave out `until`"));
                    }
                    items.push(Item::Loop { pass, count: n, until, body });
                }
                _ => {
                    if let Some(wired) = self.pass(pass, loops) {
                        items.push(Item::Pass(wired));
                    }
                }
            }
        }
        items
    }

    fn until(&mut self, e: &crate::graph::expr::Expr) -> Option<(String, Comparison, f32)> {
        let ExprKind::Binary(op, left, right) = &e.kind else { return None };
        let ExprKind::Name(buffer) = &left.kind else { return None };
        let comparison = match op {
            Binary::Less => Comparison::Less,
            Binary::LessEqual => Comparison::LessEqual,
            Binary::Greater => Comparison::Greater,
            _ => Comparison::GreaterEqual,
        };
        let value = right.eval(&|n| self.value(n));
        let value = match self.keep(value)? {
            Val::Int(i) => i as f32,
            Val::Float(f) => f as f32,
            _ => {
                self.faults.push(Diagnostic::error("expected a number").at(&right.span, ""));
                return None;
            }
        };
        Some((buffer.clone(), comparison, value))
    }

    fn pass(&mut self, pass: &'g Pass, loops: &[String]) -> Option<Wired<'g>> {
        let each = match &pass.each {
            Some(e) => {
                let n = request::count(e, self.values, "a number of members");
                let n = self.keep(n)?;
                if n == 0 {
                    self.out.off.push((pass, format!("`{}` is 0", e.span.text())));
                    return None;
                }
                Some(n)
            }
            None => None,
        };
        let mut wired =
            Wired { pass, shader: None, each, uses: vec![], color: vec![], bindings: vec![], loops: loops.to_vec() };
        match &pass.kind {
            PassKind::Copy { from, to } => {
                wired.uses.push(by_name(from, Mode::Read, How::CopySource));
                wired.uses.push(by_name(to, Mode::Write, How::CopyTarget));
                return Some(wired);
            }
            PassKind::Clear { target, .. } => {
                wired.uses.push(by_name(target, Mode::Write, How::Cleared));
                return Some(wired);
            }
            PassKind::Loop { .. } => return None,
            PassKind::Draw(_) | PassKind::Screen(_) | PassKind::Compute { .. } | PassKind::Reduce { .. } => {}
        }
        let name = pass.kind.shader()?;
        let (index, shader) = self.shader(pass, name)?;
        wired.shader = Some(index);
        let stages: &[Stage] = match &pass.kind {
            PassKind::Draw(_) => &[Stage::Vertex, Stage::Fragment],
            PassKind::Screen(_) => &[Stage::Fragment],
            _ => &[Stage::Compute],
        };
        let need = match &pass.kind {
            PassKind::Draw(_) => Stage::Vertex,
            PassKind::Screen(_) => Stage::Fragment,
            _ => Stage::Compute,
        };
        if shader.interface.entry(need).is_none() {
            let word = format!("{need:?}").to_lowercase();
            let d = Diagnostic::error(format!("`{}` has no @{word} entry point", name.value)).at(&name.span, "");
            self.faults.push(d.help(format!("a {} needs one", pass.kind.word())));
            return None;
        }
        self.variables(&mut wired, &shader, stages);
        match &pass.kind {
            PassKind::Draw(r) => {
                self.vertex_inputs(name, &shader);
                self.targets(&mut wired, r, &shader);
            }
            PassKind::Screen(r) => self.targets(&mut wired, r, &shader),
            PassKind::Reduce { from, to, .. } => {
                wired.uses.push(by_name(from, Mode::Read, How::Sampled));
                wired.uses.push(by_name(to, Mode::Write, How::Storage));
            }
            _ => {}
        }
        self.feedback(&wired);
        Some(wired)
    }

    fn shader(&mut self, pass: &Pass, name: &Name) -> Option<(usize, Arc<Shader>)> {
        let mentioned = mentioned_defs(self.request.library, &name.value);
        let mut defs = Defs::new();
        for (key, e) in self.graph().defines.iter().chain(&pass.defines) {
            let val = e.eval(&|n| self.value(n));
            let Some(val) = self.keep(val) else { continue };
            let def = match val {
                Val::Bool(b) => Some(Def::Bool(b)),
                Val::Int(i) => i32::try_from(i).ok().map(Def::Int),
                _ => None,
            };
            match def {
                Some(def) if mentioned.contains(&key.value) => drop(defs.insert(key.value.clone(), def)),
                Some(_) => {}
                None => self.faults.push(
                    Diagnostic::error(format!("`{}` must be a boolean or a 32-bit integer", key.value)).at(&e.span, ""),
                ),
            }
        }
        if let Some(i) = self.out.shaders.iter().position(|s| s.path == name.value && s.defs == defs) {
            return Some((i, self.out.shaders[i].clone()));
        }
        match compose(self.request.library, &name.value, &defs) {
            Ok(shader) => {
                self.out.shaders.push(Arc::new(shader));
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

    fn variables(&mut self, wired: &mut Wired<'g>, shader: &Shader, stages: &[Stage]) {
        let mut access: BTreeMap<usize, Access> = BTreeMap::new();
        for entry in stages.iter().filter_map(|s| shader.interface.entry(*s)) {
            for (i, a) in &entry.uses {
                let there = access.entry(*i).or_default();
                there.read |= a.read;
                there.write |= a.write;
            }
        }
        for (i, v) in shader.interface.variables.iter().enumerate() {
            let wire = self.variable(wired, shader, v, access.get(&i).copied());
            wired.bindings.push(wire.unwrap_or(Wire::Source));
        }
        for (from, _) in &wired.pass.bind {
            let variable = shader.interface.variables.iter().any(|v| v.name == from.value);
            let outputs = shader.interface.entry(Stage::Fragment).map_or(&[][..], |e| &e.outputs);
            if !variable && !outputs.iter().any(|o| o.name.as_ref() == Some(&from.value)) {
                let names = shader.interface.variables.iter().map(|v| v.name.as_str());
                let d = Diagnostic::error(format!("the shader has no variable `{}`", from.value)).at(&from.span, "");
                self.faults.push(d.nearest(&from.value, names));
            }
        }
    }

    /// The wire of one variable; `None` after a fault.
    fn variable(
        &mut self,
        wired: &mut Wired<'g>,
        shader: &Shader,
        v: &Variable,
        access: Option<Access>,
    ) -> Option<Wire> {
        let bound = wired.pass.bind.iter().find(|(from, _)| from.value == v.name).map(|(_, to)| to);
        let target = bound.map_or(v.name.as_str(), |to| to.value.as_str()).to_string();
        let place = bound.map_or_else(|| self.locate(wired.pass, shader, &v.name), |to| to.span.clone());
        if matches!(wired.pass.kind, PassKind::Reduce { .. }) && bound.is_none() {
            match v.name.as_str() {
                "source" => return self.reduce_variable(wired, v, &place, true),
                "result" => return self.reduce_variable(wired, v, &place, false),
                _ => {}
            }
        }
        if let BindingKind::Uniform(layout) = &v.kind {
            let binding = self.uniform(wired, shader, layout, &v.name, &target)?;
            return Some(Wire::Fixed(binding));
        }
        if v.name == "scene_textures" && matches!(v.kind, BindingKind::Texture { dim: TextureDim::D2Array, .. }) {
            return Some(Wire::Fixed(Binding::SceneTextures));
        }
        if let Some((table, columns)) = TABLES.iter().find(|t| t.0 == target) {
            return self.table(shader, wired.pass, v, table, columns, &place);
        }
        let Some(declared) = self.sizes.declared(&target) else {
            let d = Diagnostic::error(format!("nothing is called `{target}`: the shader's variable can't be bound"));
            let names = self.graph().resources.iter().map(|(n, _)| n.value.as_str()).chain(TABLES.iter().map(|t| t.0));
            let d = d.at(&place, "").nearest(&target, names);
            self.faults.push(d.help(format!(
                "declare a resource `{target}`, or add `bind: {{\"{}\": \"…\"}}` to `{}`",
                v.name, wired.pass.name.value
            )));
            return None;
        };
        if let ResourceKind::Sampler(desc) = &declared.kind {
            return match v.kind {
                BindingKind::Sampler { comparison } if comparison == desc.compare.is_some() => {
                    Some(Wire::Fixed(Binding::Sampler(*desc)))
                }
                BindingKind::Sampler { comparison } => {
                    let d = Diagnostic::error(format!("`{target}`: the shader and the graph differ on comparison"));
                    let help = if comparison { "give it `compare: LessEqual`" } else { "leave out `compare`" };
                    self.faults.push(d.at(&declared.span, "").at(&place, "").help(help));
                    None
                }
                _ => {
                    self.mismatch(&target, "a sampler", v, &place, &declared.span);
                    None
                }
            };
        }
        let sized = self.sizes.of(&target)?;
        let sized = self.keep(sized)?;
        let how = self.fits(v, &target, &sized.desc, &place, &declared.span)?;
        let access = access.unwrap_or_default();
        let mode = match (access.read, access.write) {
            (true, true) => Mode::ReadWrite,
            (true, false) => Mode::Read,
            (false, true) => Mode::Partial,
            (false, false) => Mode::Size,
        };
        wired.uses.push(Use { resource: target.clone(), mode, how, span: place });
        Some(Wire::Resource(target))
    }

    fn reduce_variable(&mut self, wired: &Wired<'g>, v: &Variable, place: &Span, source: bool) -> Option<Wire> {
        let PassKind::Reduce { from, to, .. } = &wired.pass.kind else { return None };
        let name = if source { from } else { to };
        let sized = self.sizes.of(&name.value)?;
        let sized = self.keep(sized)?;
        self.fits(v, &name.value, &sized.desc, place, &name.span)?;
        Some(if source { Wire::Source } else { Wire::Target })
    }

    fn mismatch(&mut self, name: &str, is: &str, v: &Variable, place: &Span, declared: &Span) {
        let wants = describe(&v.kind);
        let d = Diagnostic::error(format!("`{name}` is {is}, but the shader's `{}` is {wants}", v.name));
        self.faults.push(d.at(place, wants).at(declared, "declared here"));
    }

    /// Whether a variable can be bound to a resource of this description, and as what.
    fn fits(&mut self, v: &Variable, name: &str, desc: &Desc, place: &Span, declared: &Span) -> Option<How> {
        let t = match (&v.kind, desc) {
            (BindingKind::Storage { .. }, Desc::Buffer { size, .. }) => {
                if let BindingKind::Storage { fixed_size: Some(fixed), .. } = v.kind
                    && u64::from(fixed) > *size
                {
                    let d = Diagnostic::error(format!("`{name}` has {size} bytes, the shader needs {fixed}"));
                    self.faults.push(d.at(place, "").at(declared, "declared here"));
                    return None;
                }
                return Some(How::Storage);
            }
            (BindingKind::Texture { .. } | BindingKind::StorageTexture { .. }, Desc::Texture(t)) => t,
            (_, Desc::Buffer { .. }) => {
                self.mismatch(name, "a buffer", v, place, declared);
                return None;
            }
            (_, Desc::Texture(_)) => {
                self.mismatch(name, "a texture", v, place, declared);
                return None;
            }
        };
        let dim = match &v.kind {
            BindingKind::Texture { dim, .. } | BindingKind::StorageTexture { dim, .. } => *dim,
            _ => return None,
        };
        let good = match t.kind {
            TextureKind::D2 { array } => {
                dim == TextureDim::D2Array || dim == TextureDim::D2 && (!array || t.layers == 1)
            }
            TextureKind::Cube { array } => {
                dim == TextureDim::D2Array || dim == TextureDim::Cube && !array || dim == TextureDim::CubeArray
            }
            TextureKind::D3 => dim == TextureDim::D3,
        };
        if !good {
            let is = match t.kind {
                TextureKind::D2 { array: true } => "a 2D array texture",
                TextureKind::D2 { array: false } => "a 2D texture",
                TextureKind::Cube { .. } => "a cube texture",
                TextureKind::D3 => "a 3D texture",
            };
            self.mismatch(name, is, v, place, declared);
            return None;
        }
        match &v.kind {
            BindingKind::StorageTexture { format, access, .. } => {
                if *format != t.format {
                    let d = Diagnostic::error(format!("`{name}` is {:?}, the shader stores {format:?}", t.format));
                    self.faults.push(d.at(place, "").at(declared, "declared here"));
                    return None;
                }
                let features = format.guaranteed_format_features(self.request.features);
                let both = *access == wgpu::StorageTextureAccess::ReadWrite;
                let able = features.allowed_usages.contains(wgpu::TextureUsages::STORAGE_BINDING)
                    && (!both || features.flags.contains(wgpu::TextureFormatFeatureFlags::STORAGE_READ_WRITE));
                if !able {
                    let what = if both { "reading and writing at once" } else { "storage" };
                    let d = Diagnostic::error(format!("{format:?} does not allow {what}")).at(declared, "");
                    self.faults.push(
                        d.at(place, "")
                            .help("R32Float, R32Uint and R32Sint allow both; Rgba32Float, Rgba16Float allow writing"),
                    );
                    return None;
                }
                Some(How::Storage)
            }
            BindingKind::Texture { sample, .. } => {
                let good = match (sample, t.format.sample_type(None, Some(self.request.features))) {
                    (TextureSample::Float { filtered }, Some(wgpu::TextureSampleType::Float { filterable })) => {
                        if *filtered && !filterable {
                            let d = Diagnostic::error(format!("{:?} can't be filtered on this adapter", t.format));
                            self.faults.push(
                                d.at(place, "sampled here")
                                    .at(declared, "declared here")
                                    .help("use textureLoad, or a 16-bit format"),
                            );
                            return None;
                        }
                        true
                    }
                    (TextureSample::Float { filtered }, Some(wgpu::TextureSampleType::Depth)) => !filtered,
                    (TextureSample::Depth, Some(wgpu::TextureSampleType::Depth))
                    | (TextureSample::Uint, Some(wgpu::TextureSampleType::Uint))
                    | (TextureSample::Sint, Some(wgpu::TextureSampleType::Sint)) => true,
                    _ => false,
                };
                if !good {
                    self.mismatch(name, &format!("of format {:?}", t.format), v, place, declared);
                    return None;
                }
                Some(How::Sampled)
            }
            _ => None,
        }
    }

    fn table(
        &mut self,
        shader: &Shader,
        pass: &Pass,
        v: &Variable,
        table: &str,
        columns: &[(&str, Type)],
        place: &Span,
    ) -> Option<Wire> {
        let BindingKind::Storage { element, stride, writable, .. } = &v.kind else {
            self.mismatch(table, "a table of the scene", v, place, place);
            return None;
        };
        if *writable {
            let d = Diagnostic::error(format!("the scene's table `{table}` can't be written")).at(place, "");
            self.faults.push(d.help("declare it `var<storage, read>`"));
            return None;
        }
        for m in &element.members {
            let column = columns.iter().find(|c| c.0 == m.name);
            let span = self.locate(pass, shader, &m.name);
            match column {
                None => {
                    let d = Diagnostic::error(format!("the table `{table}` has no column `{}`", m.name)).at(&span, "");
                    self.faults.push(d.nearest(&m.name, columns.iter().map(|c| c.0)));
                }
                Some((_, ty)) if !castable(*ty, m.ty) => {
                    let d =
                        Diagnostic::error(format!("`{table}.{}` is a {}, not a {}", m.name, ty.wgsl(), m.ty.wgsl()));
                    self.faults.push(d.at(&span, ""));
                }
                Some(_) => {}
            }
        }
        if element.members.is_empty() {
            let d = Diagnostic::error(format!("the rows of `{table}` must be a struct of columns")).at(place, "");
            self.faults.push(d);
        }
        let used = TableUse { table: table.to_string(), row: element.clone(), stride: *stride };
        let index = self.out.tables.iter().position(|t| *t == used).unwrap_or_else(|| {
            self.out.tables.push(used);
            self.out.tables.len() - 1
        });
        Some(Wire::Fixed(Binding::Table(index)))
    }

    /// A uniform's members, each a value by name. A renamed plain value asks for its new name.
    fn uniform(
        &mut self,
        wired: &Wired<'g>,
        shader: &Shader,
        layout: &Layout,
        variable: &str,
        target: &str,
    ) -> Option<Binding> {
        let mut layout = layout.clone();
        if let [only] = &mut layout.members[..]
            && only.name == variable
        {
            only.name = target.to_string();
        }
        let mut extra = self.atlas_facts(wired, shader);
        let mut good = true;
        for m in &layout.members {
            if m.name == "member" && wired.each.is_some() {
                extra.insert("member".into(), Value::Uint(0));
            }
            let ty = extra.get(&m.name).or_else(|| self.values.get(&m.name)).map(|v| (v.ty(), v.cast(m.ty).is_some()));
            let ty = ty.or_else(|| wired.loops.contains(&m.name).then_some((Type::Uint, castable(Type::Uint, m.ty))));
            let frame = || FRAME_VALUES.iter().find(|f| f.0 == m.name).map(|f| (f.1, castable(f.1, m.ty)));
            match ty.or_else(frame) {
                Some((_, true)) => {}
                Some((ty, false)) => {
                    let d = Diagnostic::error(format!(
                        "`{}` is a {}, the shader wants a {}",
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

    /// `v_tile`, `v_columns`, `v_count` of the atlases bound to variables.
    fn atlas_facts(&self, wired: &Wired<'g>, shader: &Shader) -> Values {
        let mut facts = Values::new();
        for v in &shader.interface.variables {
            let bound = wired.pass.bind.iter().find(|(from, _)| from.value == v.name).map(|(_, to)| &to.value);
            let resource = match &wired.pass.kind {
                PassKind::Reduce { from, .. } if v.name == "source" => &from.value,
                PassKind::Reduce { to, .. } if v.name == "result" => &to.value,
                _ => bound.unwrap_or(&v.name),
            };
            if let Some(Ok(sized)) = self.sizes.of(resource)
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

    fn vertex_inputs(&mut self, name: &Name, shader: &Shader) {
        let Some(entry) = shader.interface.entry(Stage::Vertex) else { return };
        let known = crate::scene::VERTEX_ATTRIBUTES;
        for input in &entry.inputs {
            match known.iter().find(|a| a.0 == input.name) {
                None => {
                    let d = Diagnostic::error(format!("`{}`: vertices have no attribute `{}`", name.value, input.name));
                    self.faults.push(d.at(&name.span, "").nearest(&input.name, known.map(|a| a.0)));
                }
                Some(a) if a.1 != input.format => {
                    let d = Diagnostic::error(format!(
                        "`{}`: the attribute `{}` is {:?}, not {:?}",
                        name.value, a.0, a.1, input.format
                    ));
                    self.faults.push(d.at(&name.span, ""));
                }
                Some(_) => {}
            }
        }
    }

    fn targets(&mut self, wired: &mut Wired<'g>, r: &'g Raster, shader: &Shader) {
        let outputs: &[Output] = shader.interface.entry(Stage::Fragment).map_or(&[], |e| &e.outputs);
        for o in outputs {
            let bound = |n: &str| wired.pass.bind.iter().find(|(from, _)| from.value == n).map(|(_, to)| to.clone());
            let (resource, span) = match (&o.name, &r.color) {
                (Some(n), _) => match bound(n) {
                    Some(to) => (to.value, to.span),
                    None => (n.clone(), self.locate(wired.pass, shader, n)),
                },
                (None, Some(c)) => (c.value.clone(), c.span.clone()),
                (None, None) => {
                    let d = Diagnostic::error("the fragment shader returns a value without a name");
                    self.faults.push(d.at(&r.shader.span, "").help("say where it goes: `color: \"name\"`"));
                    continue;
                }
            };
            if let (Some(_), Some(c)) = (&o.name, &r.color) {
                let d = Diagnostic::error("`color` is for a fragment shader that returns a bare value");
                self.faults.push(d.at(&c.span, "this one's outputs have names").help("use `bind` to rename them"));
            }
            let Some(declared) = self.sizes.declared(&resource) else {
                let d =
                    Diagnostic::error(format!("nothing is called `{resource}`: the fragment's output has no target"));
                let names = self.graph().resources.iter().map(|(n, _)| n.value.as_str());
                self.faults.push(d.at(&span, "").nearest(&resource, names));
                continue;
            };
            let Some(sized) = self.sizes.of(&resource).and_then(|s| self.keep(s)) else { continue };
            if let Desc::Texture(t) = &sized.desc {
                self.output_fits(o, &resource, t.format, &span, &declared.span);
            } else {
                let d = Diagnostic::error(format!("`{resource}` is a buffer, it can't be a colour target"));
                self.faults.push(d.at(&span, "").at(&declared.span, "declared here"));
                continue;
            }
            let mode = self.target_mode(wired, r, &resource);
            wired.color.push((o.location, resource.clone()));
            wired.uses.push(Use { resource, mode, how: How::Target, span });
        }
        wired.color.sort();
        if let Some(depth) = &r.depth {
            let mode = if r.depth_write { self.target_mode(wired, r, &depth.value) } else { Mode::Read };
            wired.uses.push(by_name(depth, mode, How::Target));
        } else if shader.interface.entry(Stage::Fragment).is_some_and(|e| e.writes_depth) {
            let d = Diagnostic::error("the shader writes depth, but the pass has no depth target");
            self.faults.push(d.at(&r.shader.span, "").help("add `depth: \"name\"`"));
        }
        if outputs.is_empty() && r.depth.is_none() {
            let d = Diagnostic::error("the pass has neither a colour output nor a depth target");
            self.faults.push(d.at(&wired.pass.name.span, ""));
        }
        let named: BTreeSet<&str> =
            wired.uses.iter().filter(|u| u.how == How::Target).map(|u| u.resource.as_str()).collect();
        let strays = r.load.iter().chain(r.clear.iter().map(|c| &c.0)).filter(|n| !named.contains(n.value.as_str()));
        let strays: Vec<Diagnostic> = strays
            .map(|n| {
                let d = Diagnostic::error(format!("`{}` is not a target of this pass", n.value)).at(&n.span, "");
                d.nearest(&n.value, named.iter().copied())
            })
            .collect();
        self.faults.extend(strays);
    }

    /// A target is overwritten whole, unless it is loaded or only some of its layers are drawn to.
    fn target_mode(&self, wired: &Wired, r: &Raster, resource: &str) -> Mode {
        if r.load.iter().any(|n| n.value == resource) {
            return Mode::ReadWrite;
        }
        let layers = match self.sizes.of(resource) {
            Some(Ok(s)) => match &s.desc {
                Desc::Texture(t) if t.tiles.is_none() && s.members.is_none() => t.layers,
                _ => 1,
            },
            _ => 1,
        };
        let drawn = if r.layer.is_some() { 1 } else { wired.each.unwrap_or(1) };
        if layers > drawn { Mode::Partial } else { Mode::Write }
    }

    fn output_fits(&mut self, o: &Output, name: &str, format: wgpu::TextureFormat, span: &Span, declared: &Span) {
        let kind = match format.sample_type(None, Some(wgpu::Features::FLOAT32_FILTERABLE)) {
            Some(wgpu::TextureSampleType::Float { .. }) => OutputKind::Float,
            Some(wgpu::TextureSampleType::Uint) => OutputKind::Uint,
            Some(wgpu::TextureSampleType::Sint) => OutputKind::Sint,
            _ => {
                let d = Diagnostic::error(format!("`{name}` is {format:?}, not a colour format")).at(span, "");
                self.faults.push(d.at(declared, "declared here"));
                return;
            }
        };
        let features = format.guaranteed_format_features(self.request.features);
        if !features.allowed_usages.contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
            let d = Diagnostic::error(format!("{format:?} can't be drawn to on this adapter")).at(span, "");
            self.faults.push(d.at(declared, "declared here"));
        } else if kind != o.kind || format.components() > o.components {
            let wants = format!("{:?} with {} components", kind, format.components());
            let has = format!("{:?} with {}", o.kind, o.components);
            let d = Diagnostic::error(format!("`{name}` is {format:?}: it takes {wants}, the shader gives {has}"));
            self.faults.push(d.at(span, "").at(declared, "declared here"));
        }
    }

    /// A texture that is read and written in one pass.
    fn feedback(&mut self, wired: &Wired) {
        for (i, a) in wired.uses.iter().enumerate() {
            for b in &wired.uses[i + 1..] {
                let texture = matches!(self.sizes.of(&a.resource), Some(Ok(s)) if matches!(s.desc, Desc::Texture(_)));
                let clash = a.mode.writes() && b.mode != Mode::Size || b.mode.writes() && a.mode != Mode::Size;
                if a.resource == b.resource && texture && clash {
                    let d = Diagnostic::error(format!(
                        "`{}` reads and writes `{}` at once",
                        wired.pass.name.value, a.resource
                    ));
                    let d = d.at(&b.span, "").at(&a.span, "").at(&wired.pass.name.span, "in this pass");
                    self.faults
                        .push(d.help("write to another resource and copy, or keep last frame's with `history: true`"));
                }
            }
        }
    }

    /// Where a shader mentions a word: in its own text first, then in its imports, else in the pass.
    fn locate(&self, pass: &Pass, shader: &Shader, word: &str) -> Span {
        let own = std::iter::once(&shader.path).chain(&shader.sources);
        for path in own {
            if let Some(source) = self.request.library.files.get(path)
                && let Some(at) = find_word(&source.text, word)
            {
                return Span::new(source, at..at + word.len());
            }
        }
        pass.kind.shader().map_or_else(|| pass.span.clone(), |n| n.span.clone())
    }
}

/// More iterations than this are taken for a slip.
pub const LONGEST_LOOP: u32 = 65_536;

fn by_name(name: &Name, mode: Mode, how: How) -> Use {
    Use { resource: name.value.clone(), mode, how, span: name.span.clone() }
}

/// Whether any use in the items passes a test.
pub fn any_use(items: &[Item], test: &mut impl FnMut(&Use) -> bool) -> bool {
    items.iter().any(|item| match item {
        Item::Pass(w) => w.uses.iter().any(&mut *test),
        Item::Loop { body, .. } => any_use(body, test),
    })
}

/// Byte offset of a whole word in code, comments left out.
pub fn find_word(text: &str, word: &str) -> Option<usize> {
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split("//").next().unwrap_or("");
        let mut from = 0;
        while let Some(at) = code[from..].find(word).map(|i| i + from) {
            let part = |c: char| c.is_alphanumeric() || c == '_';
            let before = code[..at].chars().next_back().is_some_and(part);
            let after = code[at + word.len()..].chars().next().is_some_and(part);
            if !before && !after {
                return Some(offset + at);
            }
            from = at + word.len();
        }
        offset += line.len();
    }
    None
}

fn castable(from: Type, to: Type) -> bool {
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

fn describe(kind: &BindingKind) -> String {
    let dim = |d: &TextureDim| match d {
        TextureDim::D1 => "1d",
        TextureDim::D2 => "2d",
        TextureDim::D2Array => "2d_array",
        TextureDim::Cube => "cube",
        TextureDim::CubeArray => "cube_array",
        TextureDim::D3 => "3d",
    };
    match kind {
        BindingKind::Uniform(_) => "a uniform".into(),
        BindingKind::Storage { .. } => "a storage buffer".into(),
        BindingKind::Sampler { .. } => "a sampler".into(),
        BindingKind::StorageTexture { dim: d, format, .. } => format!("texture_storage_{}<{format:?}>", dim(d)),
        BindingKind::Texture { dim: d, sample, .. } => match sample {
            TextureSample::Depth => format!("texture_depth_{}", dim(d)),
            TextureSample::Float { .. } => format!("texture_{}<f32>", dim(d)),
            TextureSample::Uint => format!("texture_{}<u32>", dim(d)),
            TextureSample::Sint => format!("texture_{}<i32>", dim(d)),
        },
    }
}
