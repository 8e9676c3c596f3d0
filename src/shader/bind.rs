//! Bindings by name: which variables the entry points use, and the number of each.

use super::{
    link::LinkUnit,
    oil::{capabilities, tidy},
    write::{declared_at, plain},
};
use crate::diag::{Checked, Diagnostic, Faults, Span};
use naga::{
    AddressSpace, GlobalVariable, Handle, Module, ResourceBinding,
    compact::{KeepUnused, compact},
    valid::{ModuleInfo, ValidationFlags, Validator},
};

/// A module with its bindings, and what naga knows about it.
pub(super) struct Bound {
    pub module: Module,
    pub info: ModuleInfo,
    /// The resource variables in use, in the order of their names; the index is the binding.
    pub variables: Vec<(String, Handle<GlobalVariable>)>,
}

/// Drops what no entry point uses and gives each resource variable left `@group(0) @binding(i)` in the order of names.
///
/// # Errors
/// Two variables in use that have the same name in different files.
pub(super) fn bind(mut module: Module, units: &[LinkUnit]) -> Checked<Bound> {
    compact(&mut module, KeepUnused::No);
    let info = validate(&module, units)?;
    let entries = 0..module.entry_points.len();
    let mut variables = vec![];
    let mut idle = vec![];
    for (handle, variable) in module.global_variables.iter() {
        if !matches!(variable.space, AddressSpace::Uniform | AddressSpace::Storage { .. } | AddressSpace::Handle) {
            continue;
        }
        let name = plain(variable.name.as_deref().unwrap_or(""));
        let used = entries.clone().any(|i| !info.get_entry_point(i)[handle].is_empty());
        if used { variables.push((name, handle)) } else { idle.push(handle) }
    }
    variables.sort();
    let mut faults = vec![];
    for pair in variables.windows(2) {
        if let [(name, a), (other, b)] = pair
            && name == other
        {
            let mut fault = Diagnostic::error(format!("two files each declare a variable `{name}`, and both are used"));
            for handle in [a, b] {
                fault
                    .labels
                    .extend(declaration(&module, *handle, units).map(|place| (place, "declared here".to_owned())));
            }
            faults.push(fault.help("rename one, or declare it in one file and import it in the other"));
        }
    }
    Faults::check(faults, ())?;
    // Variables that are only named (`_ = &v;`) come last: no pipeline asks for them.
    let order = variables.iter().map(|(_, handle)| *handle).chain(idle);
    for (binding, handle) in (0..).zip(order) {
        module.global_variables.get_mut(handle).binding = Some(ResourceBinding { group: 0, binding });
    }
    Ok(Bound { module, info, variables })
}

/// Where a variable is declared.
pub(super) fn declaration(module: &Module, handle: Handle<GlobalVariable>, units: &[LinkUnit]) -> Option<Span> {
    declared_at(units, module.global_variables[handle].name.as_deref()?)
}

/// naga_oil has validated the module, with places; this yields the facts about it.
fn validate(module: &Module, units: &[LinkUnit]) -> Checked<ModuleInfo> {
    Validator::new(ValidationFlags::all(), capabilities()).validate(module).map_err(|e| {
        let fault = Diagnostic::error(tidy(&e.as_inner().to_string()));
        match units.last() {
            Some(root) => fault.at(&Span::new(&root.source, 0..0), "").into(),
            None => fault.into(),
        }
    })
}
