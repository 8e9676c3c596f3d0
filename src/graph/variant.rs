//! A variant: its base, then edits that name what they change.

use super::ast::{Graph, Name, Pass, PassKind, walk};
use super::read::Reader;
use super::tree::{Kind, Node};
use crate::diag::Diagnostic;

const EDITS: [&str; 20] = [
    "About",
    "AddParam",
    "RemoveParam",
    "SetDefault",
    "Let",
    "RemoveLet",
    "Define",
    "RemoveDefine",
    "AddResource",
    "ReplaceResource",
    "RemoveResource",
    "Before",
    "After",
    "Replace",
    "Remove",
    "SetShader",
    "Bind",
    "When",
    "AddOutput",
    "RemoveOutput",
];

/// Applies one edit of a variant to the graph. Faults go to the reader.
pub fn apply(reader: &mut Reader, graph: &mut Graph, edit: &Node) {
    let (word, args) = match &edit.kind {
        Kind::Tuple(Some(word), args) => (word.text(), args.as_slice()),
        _ => {
            let d = Diagnostic::error("expected an edit such as `After(\"pass\", Compute(…))`").at(&edit.span, "");
            return reader.faults.push(d);
        }
    };
    let arity = match word {
        "About" => 1,
        _ if word.starts_with("Remove") => 1,
        _ => 2,
    };
    if !EDITS.contains(&word) {
        let d = Diagnostic::error(format!("unknown edit `{word}`")).at(&edit.span, "");
        return reader.faults.push(d.nearest(word, EDITS));
    }
    if args.len() != arity {
        let d = Diagnostic::error(format!("`{word}` takes {arity} values, not {}", args.len())).at(&edit.span, "");
        return reader.faults.push(d);
    }
    let _ = edited(reader, graph, word, args);
}

/// `None` when a fault was reported.
fn edited(reader: &mut Reader, graph: &mut Graph, word: &str, args: &[Node]) -> Option<()> {
    if word == "About" {
        graph.about = reader.text(&args[0])?.value;
        return Some(());
    }
    let name = reader.name(&args[0])?;
    match word {
        "AddParam" => {
            let param = reader.param(&args[1])?;
            add(reader, &mut graph.params, name, param, "parameter")
        }
        "RemoveParam" => remove(reader, &mut graph.params, &name, "parameter"),
        "SetDefault" => {
            let at = find(reader, &graph.params, &name, "parameter")?;
            let ty = graph.params[at].1.ty;
            let value = reader.value(&args[1], ty)?;
            if let Err(why) = graph.params[at].1.accepts(&value) {
                reader.faults.push(Diagnostic::error(format!("the default is {why}")).at(&args[1].span, ""));
                return None;
            }
            graph.params[at].1.default = value;
            Some(())
        }
        "Let" => {
            let expr = reader.expr(&args[1])?;
            set(&mut graph.lets, name, expr);
            Some(())
        }
        "RemoveLet" => remove(reader, &mut graph.lets, &name, "let"),
        "RemoveDefine" => remove(reader, &mut graph.defines, &name, "definition"),
        "Define" => {
            let expr = reader.expr(&args[1])?;
            set(&mut graph.defines, name, expr);
            Some(())
        }
        "AddResource" => {
            let resource = reader.resource(&args[1])?;
            add(reader, &mut graph.resources, name, resource, "resource")
        }
        "ReplaceResource" => {
            let at = find(reader, &graph.resources, &name, "resource")?;
            graph.resources[at] = (name, reader.resource(&args[1])?);
            Some(())
        }
        "RemoveResource" => remove(reader, &mut graph.resources, &name, "resource"),
        "AddOutput" => {
            let resource = reader.name(&args[1])?;
            add(reader, &mut graph.outputs, name, resource, "output")
        }
        "RemoveOutput" => remove(reader, &mut graph.outputs, &name, "output"),
        "Before" | "After" | "Replace" => {
            let pass = reader.pass(&args[1])?;
            let (list, at) = find_pass(reader, graph, &name)?;
            match word {
                "Before" => list.insert(at, pass),
                "After" => list.insert(at + 1, pass),
                _ => list[at] = pass,
            }
            Some(())
        }
        "Remove" => {
            let (list, at) = find_pass(reader, graph, &name)?;
            list.remove(at);
            Some(())
        }
        "When" => {
            let when = reader.expr(&args[1])?;
            let (list, at) = find_pass(reader, graph, &name)?;
            list[at].when = Some(when);
            Some(())
        }
        "Bind" => {
            let binds = reader.names(Some(&args[1]));
            let (list, at) = find_pass(reader, graph, &name)?;
            for (variable, resource) in binds {
                set(&mut list[at].bind, variable, resource);
            }
            Some(())
        }
        _ => {
            let shader = reader.text(&args[1])?;
            let (list, at) = find_pass(reader, graph, &name)?;
            match &mut list[at].kind {
                PassKind::Draw(r) | PassKind::Screen(r) => r.shader = shader,
                PassKind::Compute { shader: old, .. } | PassKind::Reduce { shader: old, .. } => *old = shader,
                other => {
                    let d = Diagnostic::error(format!("a {} has no shader", other.word())).at(&name.span, "");
                    reader.faults.push(d);
                    return None;
                }
            }
            Some(())
        }
    }
}

fn find<T>(reader: &mut Reader, list: &[(Name, T)], name: &Name, noun: &str) -> Option<usize> {
    let at = list.iter().position(|(n, _)| n.value == name.value);
    if at.is_none() {
        let d = Diagnostic::error(format!("the base has no {noun} `{}`", name.value)).at(&name.span, "");
        reader.faults.push(d.nearest(&name.value, list.iter().map(|(n, _)| n.value.as_str())));
    }
    at
}

fn add<T>(reader: &mut Reader, list: &mut Vec<(Name, T)>, name: Name, item: T, noun: &str) -> Option<()> {
    if let Some((there, _)) = list.iter().find(|(n, _)| n.value == name.value) {
        let d = Diagnostic::error(format!("the base already has the {noun} `{}`", name.value));
        reader.faults.push(d.at(&name.span, "").at(&there.span, "here"));
        return None;
    }
    list.push((name, item));
    Some(())
}

fn remove<T>(reader: &mut Reader, list: &mut Vec<(Name, T)>, name: &Name, noun: &str) -> Option<()> {
    let at = find(reader, list, name, noun)?;
    list.remove(at);
    Some(())
}

fn set<T>(list: &mut Vec<(Name, T)>, name: Name, item: T) {
    match list.iter_mut().find(|(n, _)| n.value == name.value) {
        Some(there) => *there = (name, item),
        None => list.push((name, item)),
    }
}

/// The list that holds the pass, and its place in it.
fn find_pass<'g>(reader: &mut Reader, graph: &'g mut Graph, name: &Name) -> Option<(&'g mut Vec<Pass>, usize)> {
    let mut names = vec![];
    walk(&graph.passes, &mut |p| names.push(p.name.value.clone()));
    if !names.contains(&name.value) {
        let d = Diagnostic::error(format!("the base has no pass `{}`", name.value)).at(&name.span, "");
        reader.faults.push(d.nearest(&name.value, names.iter().map(String::as_str)));
        return None;
    }
    list_of(&mut graph.passes, &name.value)
}

fn list_of<'p>(passes: &'p mut Vec<Pass>, name: &str) -> Option<(&'p mut Vec<Pass>, usize)> {
    if let Some(at) = passes.iter().position(|p| p.name.value == name) {
        return Some((passes, at));
    }
    passes.iter_mut().flat_map(|p| p.kind.bodies_mut()).find_map(|body| list_of(body, name))
}
