//! Binds each variable of a shader to the resource, value or table of the same name, and checks that they fit.

use super::shaders::castable;
use super::wire::{How, Mode, ResourceUse, Wire, Wired, Wirer};
use super::{Binding, Desc, TableUse, TextureKind};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Name, Pass, PassKind, ResourceDecl, ResourceKind, Stride};
use crate::scene::{TABLES, TableKind, table};
use crate::shader::{
    Access, BindingKind, ElementType, Layout, Shader, Stage, TextureDim, TextureSample, Variable, report,
};
use crate::value::Type;
use std::collections::{BTreeMap, BTreeSet};

/// The variable that holds the numbers of the instances that a dispatch works for.
const INSTANCES: &str = "instances";

impl<'g> Wirer<'g, '_> {
    /// A wire for each variable of a shader, in the order of its interface.
    pub(super) fn variables(&mut self, wired: &mut Wired<'g>, shader: &Shader, stages: &[Stage]) {
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
        let members = |v: &Variable| match &v.kind {
            BindingKind::Uniform(layout) => layout.members.iter().map(|m| m.name.clone()).collect(),
            _ => vec![],
        };
        let values: BTreeSet<String> = shader.interface.variables.iter().flat_map(members).collect();
        for (from, _) in &wired.pass.bind {
            let variable = shader.interface.variables.iter().any(|v| v.name == from.value);
            let outputs = shader.interface.entry(Stage::Fragment).map_or(&[][..], |e| &e.outputs);
            let output = outputs.iter().any(|o| o.name.as_ref() == Some(&from.value));
            if !variable && !output && !values.contains(&from.value) {
                let names = shader.interface.variables.iter().map(|v| &v.name).chain(&values).map(String::as_str);
                let d = Diagnostic::error(format!("the shader has no variable `{}`", from.value)).at(&from.span, "");
                self.faults.push(d.nearest(&from.value, names));
            }
        }
        let texture =
            |kind: &BindingKind| matches!(kind, BindingKind::Texture { .. } | BindingKind::StorageTexture { .. });
        for (name, level) in &wired.pass.mips {
            let variable = shader.interface.variables.iter().find(|v| v.name == name.value);
            if values.contains(&name.value) || variable.is_some_and(|v| !texture(&v.kind)) {
                let d = Diagnostic::error(format!("`{}` is no texture, so it has no levels", name.value));
                self.faults.push(d.at(&level.span, "").help("leave `mip` out"));
            }
        }
        for (name, _) in wired.pass.set.iter().filter(|(name, _)| !values.contains(&name.value)) {
            let d = Diagnostic::error(format!("no uniform of the shader has a value `{}`", name.value));
            self.faults.push(d.at(&name.span, "").nearest(&name.value, values.iter().map(String::as_str)));
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
        let (target, bound) = wired.pass.target(&v.name);
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
        if let BindingKind::UniformArray { size, .. } = v.kind {
            let most = self.request.limits.max_uniform_buffer_binding_size;
            if u64::from(size) > most {
                let d = Diagnostic::error(format!(
                    "the uniform `{}` takes {size} bytes, and this adapter allows {most}",
                    v.name
                ));
                let help = "shorten the array, or declare it `var<storage, read>`";
                self.faults.push(d.at(&place, "").help(help));
                return None;
            }
        }
        if v.name == "scene_textures" && matches!(v.kind, BindingKind::Texture { dim: TextureDim::D2Array, .. }) {
            return Some(Wire::Fixed(Binding::SceneTextures));
        }
        if v.name == report::VARIABLE && matches!(v.kind, BindingKind::Storage { .. }) {
            return Some(Wire::Fixed(Binding::Report));
        }
        if v.name == INSTANCES && matches!(wired.pass.kind, PassKind::Compute { .. }) {
            return self.instances(wired, v, &place);
        }
        if let Some(TableKind { name: table, columns, .. }) = table(&target) {
            return self.table(shader, wired.pass, v, table, columns, &place);
        }
        let Some(declared) = self.sizes.declared(&target) else {
            let d = Diagnostic::error(format!("nothing is called `{target}`: the shader's variable can't be bound"));
            let names =
                self.graph().resources.iter().map(|(n, _)| n.value.as_str()).chain(TABLES.iter().map(|t| t.name));
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
        if let ResourceKind::Table { of, columns } = &declared.kind {
            return self.table_texels(v, (of, columns), &place, &declared.span);
        }
        let sized = self.sizes.of(&target)?;
        let sized = self.keep(sized)?;
        let how = self.fits(v, &target, &sized.desc, &place, &declared.span)?;
        self.stride_fits(v, &target, (declared, sized.stride), &place)?;
        let access = access.unwrap_or_default();
        let mode = match (access.read, access.write) {
            // They are cleared before.
            (_, true) if self.bits.contains(target.as_str()) => Mode::Write,
            (true, true) => Mode::ReadWrite,
            (true, false) => Mode::Read,
            (false, true) => Mode::Partial,
            (false, false) => Mode::Size,
        };
        let said = self.mip(wired.pass, &v.name, &target, &sized.desc)?;
        // A shader stores to one level.
        let several = matches!(&sized.desc, Desc::Texture(t) if t.mips > 1);
        let stored = matches!(v.kind, BindingKind::StorageTexture { .. }) && several;
        let mip = said.or(stored.then_some(0)).filter(|_| several);
        wired.uses.push(ResourceUse { resource: target.clone(), mip, mode, how, span: place });
        Some(match mip {
            Some(level) => Wire::Level(target, level),
            None => Wire::Resource(target),
        })
    }

    /// The instances of a dispatch, where the pass has any.
    fn instances(&mut self, wired: &Wired<'g>, v: &Variable, place: &Span) -> Option<Wire> {
        let numbers = |element: &Layout| matches!(&element.members[..], [only] if only.ty == Type::Uint);
        let BindingKind::Storage { element, fixed_size: None, writable: false, .. } = &v.kind else {
            self.mismatch(INSTANCES, "a list of numbers", v, place, &wired.pass.name.span);
            return None;
        };
        if !numbers(element) {
            let d = Diagnostic::error("the instances of a dispatch are numbers").at(place, "");
            self.faults.push(d.help("declare them `var<storage, read> instances: array<u32>`"));
            return None;
        }
        if wired.each.is_none() {
            let d = Diagnostic::error(format!("`{}` has no instances", wired.pass.name.value)).at(place, "read here");
            self.faults.push(d.at(&wired.pass.name.span, "").help("give it `each`: how many it has"));
            return None;
        }
        Some(Wire::Fixed(Binding::Instances))
    }

    fn reduce_variable(&mut self, wired: &Wired<'g>, v: &Variable, place: &Span, source: bool) -> Option<Wire> {
        let PassKind::Reduce { from, to, .. } = &wired.pass.kind else { return None };
        let name = if source { from } else { to };
        let sized = self.sizes.of(&name.value)?;
        let sized = self.keep(sized)?;
        self.fits(v, &name.value, &sized.desc, place, &name.span)?;
        Some(if source { Wire::Source } else { Wire::Result })
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
                let BindingKind::Storage { fixed_size, .. } = v.kind else { return None };
                let needed = fixed_size.unwrap_or(0);
                return self.long_enough(name, *size, needed, place, declared).then_some(How::Storage);
            }
            (BindingKind::UniformArray { size: needed, .. }, Desc::Buffer { size, .. }) => {
                return self.long_enough(name, *size, *needed, place, declared).then_some(How::Uniform);
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
                let both = *access == wgpu_types::StorageTextureAccess::ReadWrite;
                let able = features.allowed_usages.contains(wgpu_types::TextureUsages::STORAGE_BINDING)
                    && (!both || features.flags.contains(wgpu_types::TextureFormatFeatureFlags::STORAGE_READ_WRITE));
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
                    (TextureSample::Float { filtered }, Some(wgpu_types::TextureSampleType::Float { filterable })) => {
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
                    (TextureSample::Float { filtered }, Some(wgpu_types::TextureSampleType::Depth)) => !filtered,
                    (TextureSample::Depth, Some(wgpu_types::TextureSampleType::Depth))
                    | (TextureSample::Uint, Some(wgpu_types::TextureSampleType::Uint))
                    | (TextureSample::Sint, Some(wgpu_types::TextureSampleType::Sint)) => true,
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

    /// Whether a shader's elements lie where a buffer's do; it may take each for several smaller ones.
    fn stride_fits(
        &mut self,
        v: &Variable,
        name: &str,
        (declared, has): (&ResourceDecl, u32),
        place: &Span,
    ) -> Option<()> {
        let Some((takes, of)) = v.kind.elements() else { return Some(()) };
        let same = match (of, &declared.kind) {
            (ElementType::Struct(element), ResourceKind::Buffer { stride: Stride::Of(said), .. }) => {
                said.value == *element
            }
            _ => false,
        };
        // A single element may lie over several of the buffer's.
        let single = matches!(v.kind, BindingKind::Storage { fixed_size, .. } if fixed_size == Some(takes));
        if has == takes || (single || has.is_multiple_of(takes.max(1))) && !same {
            return Some(());
        }
        let plain = match &v.kind {
            BindingKind::Storage { element, .. } | BindingKind::UniformArray { element, .. } => element.members.first(),
            _ => None,
        };
        let element = match (of, plain) {
            (ElementType::Struct(element), _) => Some(element.as_str()),
            (ElementType::Plain, plain) => plain.map(|m| m.ty.wgsl()),
        };
        let whose = element.map_or(format!("those of the shader's `{}`", v.name), |e| format!("the shader's `{e}`"));
        let d = Diagnostic::error(format!("`{name}` has elements of {has} bytes, {whose} takes {takes}"));
        let field = element.map_or(format!("stride: {takes}"), |e| format!("element: \"{e}\""));
        let help = match same {
            true => "let the shaders import one struct, or name the other differently".into(),
            false => format!("declare it as `Buffer({field}, …)`, with as many elements as the shader asks for"),
        };
        self.faults.push(d.at(place, "").at(&declared.span, "declared here").help(help));
        None
    }

    fn long_enough(&mut self, name: &str, size: u64, needed: u32, place: &Span, declared: &Span) -> bool {
        let enough = u64::from(needed) <= size;
        if !enough {
            let d = Diagnostic::error(format!("`{name}` has {size} bytes, the shader needs {needed}"));
            self.faults.push(d.at(place, "").at(declared, "declared here"));
        }
        enough
    }

    pub(super) fn table(
        &mut self,
        shader: &Shader,
        pass: &Pass,
        v: &Variable,
        table: &str,
        columns: &[(&str, Type)],
        place: &Span,
    ) -> Option<Wire> {
        let (element, stride, fixed) = match &v.kind {
            BindingKind::Storage { element, stride, fixed_size, .. } => (element, *stride, *fixed_size),
            BindingKind::UniformArray { element, stride, size, .. } => (element, *stride, Some(*size)),
            _ => {
                let wants = describe(&v.kind);
                let d = Diagnostic::error(format!(
                    "`{table}` is a table of the scene, but the shader's `{}` is {wants}",
                    v.name
                ));
                let help = format!("declare a resource `Table(of: \"{table}\", columns: […])` and bind that");
                self.faults.push(d.at(place, wants).help(help));
                return None;
            }
        };
        if let BindingKind::Storage { writable: true, .. } = v.kind {
            let d = Diagnostic::error(format!("the scene's table `{table}` can't be written")).at(place, "");
            self.faults.push(d.help("declare it `var<storage, read>`"));
            return None;
        }
        // A row that is no struct is reflected as one member, named as the variable.
        if matches!(&element.members[..], [] | [_]) && element.members.iter().all(|m| m.name == v.name) {
            let d = Diagnostic::error(format!("the rows of `{table}` must be a struct of columns")).at(place, "");
            self.faults
                .push(d.help(format!("columns: {}", columns.iter().map(|c| c.0).collect::<Vec<_>>().join(", "))));
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
                    let d = Diagnostic::error(format!(
                        "`{table}.{}` is of type {}, not {}",
                        m.name,
                        ty.wgsl(),
                        m.ty.wgsl()
                    ));
                    self.faults.push(d.at(&span, ""));
                }
                Some(_) => {}
            }
        }
        let used = TableUse {
            table: table.to_string(),
            row: element.clone(),
            stride,
            rows: fixed.map(|bytes| bytes / stride.max(1)),
            texels: false,
        };
        Some(self.table_use(used))
    }

    /// Columns of a table as texels.
    fn table_texels(
        &mut self,
        v: &Variable,
        (of, columns): (&Name, &[Name]),
        place: &Span,
        declared: &Span,
    ) -> Option<Wire> {
        use wgpu_types::{StorageTextureAccess, TextureFormat};
        match v.kind {
            BindingKind::StorageTexture { access, .. } if access != StorageTextureAccess::ReadOnly => {
                let d = Diagnostic::error(format!("the scene's table `{}` can't be written", of.value)).at(place, "");
                let help = "declare it `texture_2d<u32>` or `texture_storage_2d<rgba32uint, read>`";
                self.faults.push(d.at(declared, "declared here").help(help));
                return None;
            }
            BindingKind::StorageTexture { dim: TextureDim::D2, format: TextureFormat::Rgba32Uint, .. }
            | BindingKind::Texture { dim: TextureDim::D2, sample: TextureSample::Uint, multisampled: false } => {}
            _ => {
                self.mismatch(&v.name, "a table in texels of four u32", v, place, declared);
                return None;
            }
        }
        let kinds = table(&of.value)?.columns;
        let columns = columns.iter().filter_map(|name| kinds.iter().find(|c| c.0 == name.value));
        let row = Layout::of_members(columns.copied());
        let stride = row.size.next_multiple_of(16);
        Some(self.table_use(TableUse { table: of.value.clone(), row, stride, rows: None, texels: true }))
    }

    fn table_use(&mut self, used: TableUse) -> Wire {
        let index = self.out.tables.iter().position(|t| *t == used).unwrap_or_else(|| {
            self.out.tables.push(used);
            self.out.tables.len() - 1
        });
        Wire::Fixed(Binding::Table(index))
    }
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
        BindingKind::UniformArray { .. } => "an array in a uniform".into(),
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
