//! Culls passes that no requested output needs, and finds reads that no write precedes.

use super::Desc;
use super::sizes::{Sized, Sizes};
use super::wire::{How, Mode, ResourceUse, Wired, WiredItem, passes_of};
use crate::diag::{Diagnostic, Span};
use crate::graph::ast::{Pass, ResourceDecl};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, BTreeSet};

/// Names of the passes (loops included) that `outputs` (resource names) need.
///
/// Walks backwards: a pass is needed when something it writes is. A resource that a needed pass reads before anything
/// of this frame wrote it (history) must be written in the frame before, so the walk is repeated until nothing new
/// is needed.
pub fn live<'g>(items: &[WiredItem<'g>], outputs: &[String]) -> BTreeSet<&'g str> {
    let mut end: FxHashSet<&str> = outputs.iter().map(String::as_str).collect();
    loop {
        let mut needed = end.clone();
        let mut live = BTreeSet::new();
        block(items, &mut needed, &mut live);
        let before = end.len();
        // What is still needed at the start of the frame comes from the frame before.
        end.extend(needed);
        if end.len() == before {
            return live;
        }
    }
}

fn block<'a, 'g>(items: &'a [WiredItem<'g>], needed: &mut FxHashSet<&'a str>, live: &mut BTreeSet<&'g str>) {
    for item in items.iter().rev() {
        match item {
            WiredItem::Pass(w) => {
                if !w.uses.iter().any(|u| u.mode.writes() && needed.contains(u.resource.as_str())) {
                    continue;
                }
                live.insert(&w.pass.name.value);
                for u in w.uses.iter().filter(|u| u.mode == Mode::Write && u.mip.is_none()) {
                    needed.remove(u.resource.as_str());
                }
                needed.extend(w.uses.iter().filter(|u| u.mode.reads()).map(|u| u.resource.as_str()));
            }
            WiredItem::Loop { pass, until, body, .. } => {
                let after = needed.clone();
                let mut inside = BTreeSet::new();
                loop {
                    // What the next iteration needs at its start is needed at this one's end.
                    let mut at_end: FxHashSet<&str> = after.union(needed).copied().collect();
                    if !inside.is_empty() {
                        at_end.extend(until.iter().map(|u| u.0.as_str()));
                    }
                    let before = (inside.len(), needed.len());
                    block(body, &mut at_end, &mut inside);
                    needed.extend(at_end);
                    if before == (inside.len(), needed.len()) {
                        break;
                    }
                }
                if !inside.is_empty() {
                    live.insert(&pass.name.value);
                    live.append(&mut inside);
                }
            }
        }
    }
}

/// Keeps the live passes only.
pub fn retain<'g>(items: Vec<WiredItem<'g>>, live: &BTreeSet<&str>) -> Vec<WiredItem<'g>> {
    let keep = |item: &WiredItem| match item {
        WiredItem::Pass(w) => live.contains(w.pass.name.value.as_str()),
        WiredItem::Loop { pass, .. } => live.contains(pass.name.value.as_str()),
    };
    let inner = |item| match item {
        WiredItem::Loop { pass, count, until, body } => {
            WiredItem::Loop { pass, count, until, body: retain(body, live) }
        }
        other => other,
    };
    items.into_iter().filter(keep).map(inner).collect()
}

/// Faults of resources that are read before anything writes them, cycles among them.
pub fn unwritten(items: &[WiredItem], sizes: &Sizes, off: &[(&Pass, String)]) -> Vec<Diagnostic> {
    let passes = passes_of(items);
    let readers = readers(&passes);
    let mut faults = vec![];
    let mut written = FxHashSet::default();
    walk(items, sizes, &mut written, &mut |w: &Wired, u: &ResourceUse, level: Option<u32>| {
        let declared = sizes.declared(&u.resource);
        if declared.is_none_or(ResourceDecl::is_given) {
            return;
        }
        let at = passes.iter().position(|p| std::ptr::eq(*p, w)).unwrap_or(0);
        let level_too = |v: &ResourceUse| level.is_none() || v.mip.is_none() || v.mip == level;
        let writes = |p: &&Wired| p.uses.iter().any(|v| v.resource == u.resource && v.mode.writes() && level_too(v));
        let later = passes[at..].iter().copied().find(writes);
        faults.push(match (level, later) {
            (Some(level), None) => {
                let (name, of) = (&w.pass.name, &u.resource);
                let d =
                    Diagnostic::error(format!("`{}` reads level {level} of `{of}`, which nothing writes", name.value));
                let write = format!("write it in an earlier pass: `bind: {{\"…\": (of: \"{of}\", mip: {level})}}`");
                let read = format!("read one level alone: `bind: {{\"…\": (of: \"{of}\", mip: 0)}}`");
                d.at(&u.span, "read here").at(&name.span, "in this pass").help(write).help(read)
            }
            _ => fault(w, u, later, &readers, off),
        });
    });
    faults
}

fn fault(w: &Wired, u: &ResourceUse, later: Option<&Wired>, readers: &Readers, off: &[(&Pass, String)]) -> Diagnostic {
    let name = &w.pass.name;
    let read = |d: Diagnostic| d.at(&u.span, "read here").at(&name.span, "in this pass");
    let history = format!("give `{}` an `initial` value, or `history: true` for last frame's", u.resource);
    match later {
        Some(writer) if std::ptr::eq(writer, w) => {
            let d = Diagnostic::error(format!("`{}` reads `{}` before anything writes it", name.value, u.resource));
            read(d).help(format!("clear it first, or {history}"))
        }
        Some(writer) => {
            let word = &writer.pass.name;
            let (text, help) = match path(w, writer, readers) {
                Some(cycle) => (format!("a cycle: {cycle}"), history),
                None => (
                    format!("`{}` reads `{}`, which `{}` writes only later", name.value, u.resource, word.value),
                    format!("move `{}` before `{}`, or {history}", word.value, name.value),
                ),
            };
            read(Diagnostic::error(text)).at(&word.span, "written here").help(help)
        }
        None => {
            let d = Diagnostic::error(format!("`{}` reads `{}`, which nothing writes", name.value, u.resource));
            let mut d = read(d);
            let blank = Span::new(&name.span.source, 0..0);
            for (pass, why) in off.iter().filter(|(p, _)| p.span != blank) {
                if crate::graph::ast_mentions(pass, &u.resource) {
                    d = d.at(&pass.name.span, format!("left out: {why}"));
                }
            }
            d.help(format!("write it in an earlier pass, or {history}"))
        }
    }
}

/// The passes that read each resource, with their places.
type Readers<'a, 'g> = FxHashMap<&'a str, Vec<(usize, &'a Wired<'g>)>>;

fn readers<'a, 'g>(passes: &[&'a Wired<'g>]) -> Readers<'a, 'g> {
    let mut readers = Readers::default();
    for (place, pass) in passes.iter().copied().enumerate() {
        for u in pass.uses.iter().filter(|u| u.mode.reads()) {
            readers.entry(u.resource.as_str()).or_default().push((place, pass));
        }
    }
    readers
}

/// `a → b → a` when `from`'s results lead to `to`.
fn path(from: &Wired, to: &Wired, readers: &Readers) -> Option<String> {
    let mut came: BTreeMap<&str, &str> = BTreeMap::new();
    let mut open = vec![from];
    while let Some(p) = open.pop() {
        let written = p.uses.iter().filter(|u| u.mode.writes());
        let mut next: Vec<_> = written.filter_map(|u| readers.get(u.resource.as_str())).flatten().copied().collect();
        next.sort_by_key(|(place, _)| *place);
        for (_, q) in next {
            if !came.contains_key(q.pass.name.value.as_str()) && !std::ptr::eq(q, from) {
                came.insert(&q.pass.name.value, &p.pass.name.value);
                open.push(q);
            }
        }
    }
    let mut names = vec![from.pass.name.value.as_str()];
    let mut at = to.pass.name.value.as_str();
    while at != from.pass.name.value {
        names.push(at);
        at = came.get(at)?;
    }
    names.push(&from.pass.name.value);
    names.reverse();
    Some(names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(" → "))
}

/// Calls `unwritten` for each read of something not yet written, with the level of a texture that has several.
fn walk<'a, 'g>(
    items: &'a [WiredItem<'g>],
    sizes: &Sizes,
    written: &mut FxHashSet<(&'a str, u32)>,
    unwritten: &mut impl FnMut(&'a Wired<'g>, &'a ResourceUse, Option<u32>),
) {
    let levels = |u: &ResourceUse| match (u.mip, sizes.of(&u.resource)) {
        (Some(level), _) => level..level + 1,
        // A shader writes to one level.
        (None, _) if u.mode.writes() && matches!(u.how, How::Storage | How::Target) => 0..1,
        (None, Some(Ok(Sized { desc: Desc::Texture(t), .. }))) => 0..t.mips,
        (None, _) => 0..1,
    };
    for item in items {
        match item {
            WiredItem::Pass(w) => {
                for u in w.uses.iter().filter(|u| u.mode.reads()) {
                    let mut missing = levels(u).filter(|level| !written.contains(&(u.resource.as_str(), *level)));
                    if let Some(level) = missing.next() {
                        let several = level > 0 || u.mip.is_some();
                        unwritten(w, u, several.then_some(level));
                    }
                }
                for u in w.uses.iter().filter(|u| u.mode.writes()) {
                    written.extend(levels(u).map(|level| (u.resource.as_str(), level)));
                }
            }
            WiredItem::Loop { body, .. } => walk(body, sizes, written, unwritten),
        }
    }
}

/// Whether the first pass that touches a resource finds what the frame began with: it reads, or overwrites only a part.
pub fn starts_unwritten(items: &[WiredItem], resource: &str) -> Option<bool> {
    items.iter().find_map(|item| match item {
        WiredItem::Pass(w) => {
            let modes = w.uses.iter().filter(|u| u.resource == resource && u.mode != Mode::Size);
            let whole: Vec<bool> = modes.map(|u| u.mode == Mode::Write && u.mip.is_none()).collect();
            (!whole.is_empty()).then(|| !whole.iter().all(|whole| *whole))
        }
        WiredItem::Loop { body, .. } => starts_unwritten(body, resource),
    })
}
