//! Other names for what a graph mentions.

use super::ast::{Dirty, Name, Pass, PassKind, Raster, ResourceDecl, ResourceKind, Size, Stride};
use super::check::material_columns;
use super::expr::Expr;

/// A name to another.
pub type Rename<'r> = &'r dyn Fn(&str) -> String;

fn one(name: &mut Name, to: Rename) {
    name.value = renamed(&name.value, to);
}

/// Another name; of a member of a set also what its number mentions.
pub fn renamed(name: &str, to: Rename) -> String {
    let Some((set, index)) = name.split_once('[') else { return to(name) };
    let mut out = format!("{}[", to(set));
    let mut rest = index;
    while !rest.is_empty() {
        let part = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let end = rest.find(|c| !part(c)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        let is_name = word.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let call = after.trim_start().starts_with('(') || matches!(word, "true" | "false");
        out += &if is_name && !call { to(word) } else { word.to_string() };
        let marks = after.find(part).unwrap_or(after.len());
        out += &after[..marks];
        rest = &after[marks..];
    }
    out
}

fn size(size: &mut Size, to: Rename) {
    match size {
        Size::One(e) => e.rename(to),
        Size::Axes(axes, _) => axes.iter_mut().for_each(|e| e.rename(to)),
    }
}

/// Renames what the sizes and counts of a resource mention.
pub fn resource(r: &mut ResourceDecl, to: Rename) {
    let maybe = |e: &mut Option<Expr>| e.iter_mut().for_each(|e| e.rename(to));
    maybe(&mut r.members);
    match &mut r.kind {
        ResourceKind::Texture { size: s, layers, mips, samples, .. } => {
            size(s, to);
            [layers, mips, samples].into_iter().for_each(maybe);
        }
        ResourceKind::Cube { size: s, count, mips, .. } => {
            size(s, to);
            [count, mips].into_iter().for_each(maybe);
        }
        ResourceKind::Texture3d { size: s, mips, .. } => {
            size(s, to);
            maybe(mips);
        }
        ResourceKind::Atlas { tile, count, .. } => [tile, count].into_iter().for_each(|e| e.rename(to)),
        ResourceKind::Buffer { stride, count } => {
            count.rename(to);
            if let Stride::Bytes(bytes) = stride {
                bytes.rename(to);
            }
        }
        ResourceKind::Image(_) | ResourceKind::Table { .. } | ResourceKind::Sampler(_) => {}
    }
}

/// Renames what a pass mentions, apart from the passes in it; not its own name.
pub fn pass(p: &mut Pass, to: Rename) {
    references(p).into_iter().for_each(|n| one(n, to));
    // Columns have their names everywhere.
    let own = |name: &str| if material_columns().any(|c| c == name) { name.to_string() } else { to(name) };
    let materials = match &mut p.kind {
        PassKind::Draw(Raster { materials, .. }) => materials.take(),
        _ => None,
    };
    exprs(p).into_iter().for_each(|e| e.rename(to));
    if let (Some(mut condition), PassKind::Draw(r)) = (materials, &mut p.kind) {
        condition.rename(&own);
        r.materials = Some(condition);
    }
}

/// The resources that a pass names.
pub fn references(p: &mut Pass) -> Vec<&mut Name> {
    let mut all: Vec<&mut Name> = p.bind.iter_mut().map(|(_, n)| n).collect();
    if let Some(Dirty { bits, of }) = &mut p.only {
        all.push(bits);
        all.extend(of);
    }
    match &mut p.kind {
        PassKind::Draw(r) | PassKind::Screen(r) => {
            all.extend(r.color.iter_mut().chain(&mut r.depth).chain(&mut r.frusta).chain(&mut r.load));
            all.extend(r.clear.iter_mut().map(|(n, _)| n).chain(r.blend.iter_mut().map(|(n, _)| n)));
            all.extend(r.resolve.iter_mut().flat_map(|(from, to)| [from, to]));
            all.extend(r.vertices.iter_mut().flat_map(|v| &mut v.indirect));
        }
        PassKind::Reduce { from, to, .. } | PassKind::Scan { from, to, .. } | PassKind::Copy { from, to } => {
            all.extend([from, to]);
        }
        PassKind::Clear { target, .. } => all.push(target),
        PassKind::Mips { of } => all.push(of),
        PassKind::Compute { indirect, .. } => all.extend(indirect),
        PassKind::Loop { .. } | PassKind::For { .. } | PassKind::Fastest { .. } => {}
    }
    all
}

/// The expressions of a pass.
pub fn exprs(p: &mut Pass) -> Vec<&mut Expr> {
    let mut all: Vec<&mut Expr> = p.when.iter_mut().chain(&mut p.each).collect();
    all.extend(p.defines.iter_mut().chain(&mut p.mips).chain(&mut p.set).map(|(_, e)| e));
    match &mut p.kind {
        PassKind::Draw(r) | PassKind::Screen(r) => {
            all.extend(r.layer.iter_mut().chain(&mut r.views).chain(&mut r.tolerance).chain(&mut r.materials));
            if let Some(v) = &mut r.vertices {
                all.extend(std::iter::once(&mut v.count).chain(&mut v.instances));
            }
        }
        PassKind::Compute { over, .. } => all.extend(over.iter_mut().flat_map(Size::exprs_mut)),
        PassKind::Reduce { factor, until, .. } => {
            all.extend(factor);
            all.push(until);
        }
        PassKind::Loop { count, until, .. } => {
            all.push(count);
            all.extend(until);
        }
        PassKind::For { count, .. } => all.push(count),
        PassKind::Scan { .. }
        | PassKind::Copy { .. }
        | PassKind::Clear { .. }
        | PassKind::Mips { .. }
        | PassKind::Fastest { .. } => {}
    }
    all
}
