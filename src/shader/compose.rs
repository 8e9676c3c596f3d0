//! Imports and definitions, through naga_oil; bindings; validation; reflection.

use super::{
    bind::{Bound, bind},
    interface::Interface,
    kept::joined,
    library::Library,
    limits::{check, on_deep_stack},
    link::{LinkUnit, gather},
    oil::join,
    reflect::reflect,
    write::{RESERVED_MARKS, write},
};
use crate::content::hash;
use crate::diag::{Checked, Diagnostic, Faults, Span};
use std::collections::BTreeMap;

/// The value of a shader definition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Def {
    Bool(bool),
    Int(i32),
    Uint(u32),
}

/// Definitions by name.
///
/// `#ifdef NAME` holds when NAME has a value other than `false`; `#if NAME == VALUE` compares it; `#{NAME}` is it.
/// `#{HERE}` is the place where it stands, for [`super::report`].
pub type Defs = BTreeMap<String, Def>;

/// A composed, validated and reflected shader.
#[derive(Debug, Clone)]
pub struct Shader {
    /// The path in the library.
    pub path: String,
    pub defs: Defs,
    /// The entry points that were asked for; none: all of the text.
    pub wanted: Vec<String>,
    /// Valid, without anything that no entry point uses.
    pub module: naga::Module,
    pub interface: Interface,
    /// Library paths that went into it: its own and those of all imports, sorted.
    pub sources: Vec<String>,
    /// A hash of the module as it would be written anew. Shaders with the same content compute the same: comments,
    /// spaces and functions that no entry point calls make no difference.
    pub content: u128,
}

/// Composes `path` with `defs`, for the entry points in `wanted` alone, or for all where it is empty or names one that
/// is not there.
///
/// Resource variables need no `@group` or `@binding`: those that an entry point uses get group 0 and, as binding,
/// their place among their names in order. Attributes that are written are ignored.
///
/// # Errors
/// Unknown path, faulty directives and imports (all of them), the first parse error, the first validation error, two
/// variables of one name, types that nothing can be bound to; each with its place in the file that the user wrote.
pub fn compose(library: &Library, path: &str, defs: &Defs, wanted: &[String]) -> Checked<Shader> {
    let units = gather(library, path, defs)?;
    let mut faults = vec![];
    for unit in &units {
        for mark in RESERVED_MARKS {
            if let Some(at) = unit.source.text.find(mark) {
                let place = Span::new(&unit.source, at..at + mark.len());
                faults.push(
                    Diagnostic::error(format!("`{mark}` is reserved")).at(&place, "").help("choose another name"),
                );
            }
        }
    }
    Faults::check(faults, ())?;
    on_deep_stack(|| joined_and_reflected(library, (path, defs, wanted), &units))?
}

fn joined_and_reflected(
    library: &Library,
    (path, defs, wanted): (&str, &Defs, &[String]),
    units: &[LinkUnit],
) -> Checked<Shader> {
    let mut bindings = 0;
    let mut sources: Vec<String> = units.iter().map(|u| u.path.clone()).collect();
    sources.sort();
    let file = |unit: &LinkUnit| sources.binary_search(&unit.path).unwrap_or(0);
    let written: Vec<_> = units.iter().map(|unit| write(unit, defs, file(unit), &mut bindings)).collect();
    // A module that is kept was made of texts within the limits.
    let mut module = joined(&written, || {
        Faults::check(check(units), ())?;
        library.memo.with_oil(|oil| join(oil, units, &written))
    })?;
    let points = &mut module.entry_points;
    if !wanted.is_empty() && wanted.iter().all(|name| points.iter().any(|p| p.name == *name)) {
        points.retain(|p| wanted.contains(&p.name));
    }
    let bound = bind(module, units)?;
    let interface = reflect(&bound, units)?;
    let content = content(&bound, units, defs);
    let (path, defs, wanted) = (path.to_owned(), defs.clone(), wanted.to_vec());
    Ok(Shader { path, defs, wanted, module: bound.module, interface, sources, content })
}

fn content(bound: &Bound, units: &[LinkUnit], defs: &Defs) -> u128 {
    let flags = naga::back::wgsl::WriterFlags::empty();
    match naga::back::wgsl::write_string(&bound.module, &bound.info, flags) {
        Ok(text) => hash(&text),
        // What naga can read but not write is told apart by its texts.
        Err(_) => hash(&(defs, units.iter().map(|u| &u.scan.text).collect::<Vec<_>>())),
    }
}
