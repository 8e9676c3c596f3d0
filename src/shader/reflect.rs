//! From a bound naga module to its [`Interface`].

use super::{
    bind::{Bound, declaration},
    interface::*,
    layout,
    link::LinkUnit,
    write::plain,
};
use crate::diag::{Checked, Diagnostic, Faults};
use naga::{
    AddressSpace, Binding, Block, BuiltIn, Expression, GlobalVariable, Handle, ImageClass, ImageDimension, Module,
    Scalar, ScalarKind, Statement, StorageAccess, Type, TypeInner,
    valid::{FunctionInfo, GlobalUse},
};
use std::{collections::BTreeSet, sync::Arc};

/// Reads the interface off a module.
///
/// # Errors
/// Variables, attributes and outputs of a type that nothing can be bound to; all of them.
pub(super) fn reflect(bound: &Bound, units: &[LinkUnit]) -> Checked<Interface> {
    let mut faults = vec![];
    let mut variables = vec![];
    for (name, handle) in &bound.variables {
        match kind(bound, name, *handle) {
            Ok(kind) => variables.push(Variable { name: name.clone(), kind }),
            Err((reason, help)) => {
                let mut fault = Diagnostic::error(format!("`{name}`: {reason}"));
                fault.labels.extend(declaration(&bound.module, *handle, units).map(|place| (place, String::new())));
                faults.push(fault.help(help));
            }
        }
    }
    let mut entries = vec![];
    for (index, point) in bound.module.entry_points.iter().enumerate() {
        let stage = match point.stage {
            naga::ShaderStage::Vertex => Stage::Vertex,
            naga::ShaderStage::Fragment => Stage::Fragment,
            naga::ShaderStage::Compute => Stage::Compute,
            _ => continue,
        };
        let mut entry = EntryPoint {
            name: point.name.clone(),
            stage,
            workgroup_size: if stage == Stage::Compute { point.workgroup_size } else { [1; 3] },
            inputs: vec![],
            outputs: vec![],
            writes_depth: false,
            uses: bound
                .variables
                .iter()
                .enumerate()
                .filter_map(|(i, (_, handle))| Some((i, access(bound.info.get_entry_point(index), *handle)?)))
                .collect(),
        };
        let mut values = EntryValues { module: &bound.module, entry: &mut entry, problems: vec![] };
        match stage {
            Stage::Vertex => {
                for argument in &point.function.arguments {
                    values.input(argument.name.as_deref(), argument.ty, argument.binding.as_ref());
                }
            }
            Stage::Fragment => {
                if let Some(result) = &point.function.result {
                    values.output(None, result.ty, result.binding.as_ref());
                }
            }
            Stage::Compute => {}
        }
        for problem in values.problems {
            let mut fault = Diagnostic::error(format!("entry point `{}`: {problem}", point.name));
            if let Some(root) = units.last() {
                let place = root.outline.declared.get(&point.name).map_or(0..0, |d| d.range.clone());
                fault = fault.at(&crate::diag::Span::new(&root.source, place), "");
            }
            faults.push(fault.help("use f32, i32 or u32, or a vector of them"));
        }
        entry.inputs.sort_by_key(|i| i.location);
        entry.outputs.sort_by_key(|o| o.location);
        entries.push(entry);
    }
    Faults::check(faults, Interface { variables, entries })
}

fn access(info: &FunctionInfo, handle: Handle<GlobalVariable>) -> Option<Access> {
    let uses = info[handle];
    let atomic = uses.contains(GlobalUse::ATOMIC);
    (!uses.is_empty()).then(|| Access {
        read: atomic || uses.contains(GlobalUse::READ),
        write: atomic || uses.contains(GlobalUse::WRITE),
    })
}

/// A reason why nothing can be bound, and a remedy.
pub(super) type Unbindable = (String, String);

fn kind(bound: &Bound, name: &str, handle: Handle<GlobalVariable>) -> Result<BindingKind, Unbindable> {
    let module = &bound.module;
    let variable = &module.global_variables[handle];
    match (&module.types[variable.ty].inner, variable.space) {
        (TypeInner::Array { .. }, AddressSpace::Uniform) => {
            let (element, stride, size) = layout::of_array(module, name, variable.ty);
            match (size, layout::element_type(module, variable.ty)) {
                (Some(size), Some(of)) => Ok(BindingKind::UniformArray { element, stride, size, of }),
                _ => Err(unbindable("an array in a uniform has a fixed length", "write it as `array<T, LENGTH>`")),
            }
        }
        (_, AddressSpace::Uniform) => {
            let mut layout = layout::of_uniform(module, name, variable.ty)?;
            if let Some(read) = members_read(module, handle) {
                for (i, member) in layout.members.iter_mut().enumerate() {
                    member.read = read.contains(&(i as u32));
                }
            }
            Ok(BindingKind::Uniform(Arc::new(layout)))
        }
        (_, AddressSpace::Storage { access }) => {
            let (element, stride, fixed_size) = layout::of_array(module, name, variable.ty);
            let (of, writable) = (layout::element_type(module, variable.ty), access.contains(StorageAccess::STORE));
            Ok(BindingKind::Storage { element, stride, fixed_size, writable, of })
        }
        (TypeInner::Sampler { comparison }, _) => Ok(BindingKind::Sampler { comparison: *comparison }),
        (TypeInner::Image { dim, arrayed, class }, _) => {
            let dim = dimension(*dim, *arrayed)?;
            match *class {
                ImageClass::Sampled { kind, multi } => {
                    let sample = match kind {
                        ScalarKind::Uint => TextureSample::Uint,
                        ScalarKind::Sint => TextureSample::Sint,
                        _ => TextureSample::Float { filtered: is_sampled(bound, handle) },
                    };
                    Ok(BindingKind::Texture { dim, sample, multisampled: multi })
                }
                ImageClass::Depth { multi } => {
                    Ok(BindingKind::Texture { dim, sample: TextureSample::Depth, multisampled: multi })
                }
                ImageClass::Storage { format, access } => Ok(BindingKind::StorageTexture {
                    dim,
                    format: wgpu_naga_bridge::map_storage_format_from_naga(format),
                    access: storage_access(access)?,
                }),
                ImageClass::External => Err(unbindable("external textures aren't supported", "use `texture_2d<f32>`")),
            }
        }
        _ => Err(unbindable("nothing can be bound to this type", "use a buffer, a texture or a sampler")),
    }
}

/// The members of a struct that its variable is only asked for one by one; `None` when all of it may be asked for.
fn members_read(module: &Module, variable: Handle<GlobalVariable>) -> Option<BTreeSet<u32>> {
    let TypeInner::Struct { .. } = module.types[module.global_variables[variable].ty].inner else { return None };
    let functions = module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    let mut read = BTreeSet::new();
    for function in functions {
        let is_it = |e: Handle<Expression>| function.expressions[e] == Expression::GlobalVariable(variable);
        for (_, expression) in function.expressions.iter() {
            match *expression {
                Expression::AccessIndex { base, index } if is_it(base) => drop(read.insert(index)),
                Expression::Load { pointer: whole } | Expression::Access { base: whole, .. } if is_it(whole) => {
                    return None;
                }
                _ => {}
            }
        }
        if hands_on(&function.body, &is_it) {
            return None;
        }
    }
    Some(read)
}

/// Whether a call is given what passes a test.
fn hands_on(block: &Block, test: &impl Fn(Handle<Expression>) -> bool) -> bool {
    block.iter().any(|statement| match statement {
        Statement::Call { arguments, .. } => arguments.iter().any(|a| test(*a)),
        Statement::Block(inner) => hands_on(inner, test),
        Statement::If { accept, reject, .. } => hands_on(accept, test) || hands_on(reject, test),
        Statement::Switch { cases, .. } => cases.iter().any(|c| hands_on(&c.body, test)),
        Statement::Loop { body, continuing, .. } => hands_on(body, test) || hands_on(continuing, test),
        _ => false,
    })
}

fn unbindable(reason: &str, help: &str) -> Unbindable {
    (reason.to_owned(), help.to_owned())
}

/// An entry point uses the texture with a sampler, itself or in a function it hands both to.
fn is_sampled(bound: &Bound, image: Handle<GlobalVariable>) -> bool {
    (0..bound.module.entry_points.len())
        .any(|i| bound.info.get_entry_point(i).sampling_set.iter().any(|key| key.image == image))
}

fn dimension(dim: ImageDimension, arrayed: bool) -> Result<TextureDim, Unbindable> {
    match (dim, arrayed) {
        (ImageDimension::D1, false) => Ok(TextureDim::D1),
        (ImageDimension::D2, false) => Ok(TextureDim::D2),
        (ImageDimension::D2, true) => Ok(TextureDim::D2Array),
        (ImageDimension::D3, false) => Ok(TextureDim::D3),
        (ImageDimension::Cube, false) => Ok(TextureDim::Cube),
        (ImageDimension::Cube, true) => Ok(TextureDim::CubeArray),
        (ImageDimension::D1 | ImageDimension::D3, true) => {
            Err(unbindable("there are no arrays of 1D or 3D textures", "use a 2D array"))
        }
    }
}

fn storage_access(access: StorageAccess) -> Result<wgpu_types::StorageTextureAccess, Unbindable> {
    if access.contains(StorageAccess::ATOMIC) {
        return Err(unbindable("atomic textures aren't supported", "use a buffer of atomics"));
    }
    match (access.contains(StorageAccess::LOAD), access.contains(StorageAccess::STORE)) {
        (true, true) => Ok(wgpu_types::StorageTextureAccess::ReadWrite),
        (true, false) => Ok(wgpu_types::StorageTextureAccess::ReadOnly),
        _ => Ok(wgpu_types::StorageTextureAccess::WriteOnly),
    }
}

/// Collects what an entry point takes or returns.
struct EntryValues<'a> {
    module: &'a Module,
    entry: &'a mut EntryPoint,
    problems: Vec<String>,
}

impl EntryValues<'_> {
    fn input(&mut self, name: Option<&str>, ty: Handle<Type>, binding: Option<&Binding>) {
        let module = self.module;
        match (binding, &module.types[ty].inner) {
            (Some(Binding::Location { location, .. }), inner) => {
                let name = plain(name.unwrap_or(""));
                match vertex_format(inner) {
                    Some(format) => self.entry.inputs.push(VertexInput { name, location: *location, format }),
                    None => self.problems.push(format!("no vertex attribute fits the type of `{name}`")),
                }
            }
            (None, TypeInner::Struct { members, .. }) => {
                for member in members {
                    self.input(member.name.as_deref(), member.ty, member.binding.as_ref());
                }
            }
            _ => {}
        }
    }

    fn output(&mut self, name: Option<&str>, ty: Handle<Type>, binding: Option<&Binding>) {
        let module = self.module;
        match (binding, &module.types[ty].inner) {
            (Some(Binding::Location { location, .. }), inner) => {
                let name = name.map(plain);
                let kind = scalar(inner).and_then(|(scalar, components)| {
                    let kind = match scalar.kind {
                        ScalarKind::Float => OutputKind::Float,
                        ScalarKind::Uint => OutputKind::Uint,
                        ScalarKind::Sint => OutputKind::Sint,
                        _ => return None,
                    };
                    Some((kind, components))
                });
                match kind {
                    Some((kind, components)) => {
                        self.entry.outputs.push(Output { name, location: *location, kind, components });
                    }
                    None => self.problems.push(format!("no colour fits the type at location {location}")),
                }
            }
            (Some(Binding::BuiltIn(BuiltIn::FragDepth)), _) => self.entry.writes_depth = true,
            (None, TypeInner::Struct { members, .. }) => {
                for member in members {
                    self.output(member.name.as_deref(), member.ty, member.binding.as_ref());
                }
            }
            _ => {}
        }
    }
}

/// A scalar (one component) or vector of 32-bit numbers.
fn scalar(inner: &TypeInner) -> Option<(Scalar, u8)> {
    match *inner {
        TypeInner::Scalar(scalar) if scalar.width == 4 => Some((scalar, 1)),
        TypeInner::Vector { size, scalar } if scalar.width == 4 => Some((scalar, size as u8)),
        _ => None,
    }
}

fn vertex_format(inner: &TypeInner) -> Option<wgpu_types::VertexFormat> {
    use wgpu_types::VertexFormat as F;
    let (scalar, components) = scalar(inner)?;
    match (scalar.kind, components) {
        (ScalarKind::Float, 1) => Some(F::Float32),
        (ScalarKind::Float, 2) => Some(F::Float32x2),
        (ScalarKind::Float, 3) => Some(F::Float32x3),
        (ScalarKind::Float, 4) => Some(F::Float32x4),
        (ScalarKind::Uint, 1) => Some(F::Uint32),
        (ScalarKind::Uint, 2) => Some(F::Uint32x2),
        (ScalarKind::Uint, 3) => Some(F::Uint32x3),
        (ScalarKind::Uint, 4) => Some(F::Uint32x4),
        (ScalarKind::Sint, 1) => Some(F::Sint32),
        (ScalarKind::Sint, 2) => Some(F::Sint32x2),
        (ScalarKind::Sint, 3) => Some(F::Sint32x3),
        (ScalarKind::Sint, 4) => Some(F::Sint32x4),
        _ => None,
    }
}
