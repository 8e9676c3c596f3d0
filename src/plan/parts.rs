//! What draws take of the scene: all of it or some, simplified or as it is.

use super::Values;
use super::frames::frames;
use super::request::{Request, tolerance, values};
use crate::diag::{Checked, Diagnostic, Faults};
use crate::graph::ast::{Name, PassKind, Raster, walk};
use crate::graph::check::material_columns;
use crate::graph::expr::{Expr, Val};
use crate::scene::{Column, Level, Scene, Table, Taken};
use std::sync::Arc;

/// What a draw asks for, with all put in that is known without the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct PartRequest {
    tolerance: f32,
    materials: Option<Expr>,
    nodes: Vec<Name>,
}

/// What all draws that run ask for, each once, by tolerance; nothing where a plan will find faults.
pub fn asked(request: &Request) -> Vec<PartRequest> {
    let Ok(values) = values(request) else { return vec![] };
    let value = |name: &str| values.get(name).map(|v| Val::from(*v));
    let mut all: Vec<PartRequest> = vec![];
    walk(&request.graph.passes, &mut |pass| {
        let runs = pass.when.as_ref().is_none_or(|when| matches!(frames(when, &value), Ok(Some(_))));
        if let PassKind::Draw(r) = &pass.kind
            && runs
            && let Ok(Some(asked)) = of(r, &values)
            && !all.contains(&asked)
        {
            all.push(asked);
        }
    });
    all.sort_by(|a, b| a.tolerance.total_cmp(&b.tolerance));
    all
}

/// What a draw asks for; `None`: the scene as it is.
///
/// # Errors
/// Its tolerance is no number of metres.
pub(super) fn of(r: &Raster, values: &Values) -> Result<Option<PartRequest>, Diagnostic> {
    let tolerance = tolerance(r, values)?;
    if tolerance.is_none() && r.materials.is_none() && r.nodes.is_empty() {
        return Ok(None);
    }
    let column = |name: &str| material_columns().any(|c| c == name);
    let known = |name: &str| if column(name) { None } else { values.get(name).map(|v| Val::from(*v)) };
    let mut materials = r.materials.clone();
    materials.iter_mut().for_each(|e| e.substitute(&known));
    Ok(Some(PartRequest { tolerance: tolerance.unwrap_or(0.0), materials, nodes: r.nodes.clone() }))
}

/// The parts of a scene that draws ask for, in that order.
///
/// # Errors
/// Nodes that the scene lacks, conditions that are none of its materials.
pub fn parts(asked: &[PartRequest], scene: &Scene) -> Checked<Vec<Arc<Level>>> {
    let (mut levels, mut faults) = (vec![], vec![]);
    for asked in asked {
        match taken(asked, scene) {
            Ok(taken) => levels.push(scene.part(&taken)),
            Err(d) => faults.push(d),
        }
    }
    Faults::check(faults, levels)
}

fn taken(asked: &PartRequest, scene: &Scene) -> Result<Taken, Diagnostic> {
    let materials = match &asked.materials {
        Some(when) => Some(materials(when, scene)?),
        None => None,
    };
    let nodes = if asked.nodes.is_empty() { None } else { Some(nodes(&asked.nodes, scene)?) };
    Ok(Taken { tolerance: asked.tolerance, materials, nodes })
}

/// By material: whether the condition holds.
fn materials(when: &Expr, scene: &Scene) -> Result<Vec<bool>, Diagnostic> {
    let tables = scene.tables_named(&scene.pose(0.0), |name| name == "materials");
    let Some(table) = tables.iter().find(|t| t.name == "materials") else { return Ok(vec![]) };
    (0..scene.materials.len()).map(|row| when.truth(&|name| cell(table, name, row))).collect()
}

fn cell(table: &Table, column: &str, row: usize) -> Option<Val> {
    let floats = |v: &[f32]| Val::Floats(v.iter().map(|x| f64::from(*x)).collect());
    Some(match table.column(column)? {
        Column::Uint(all) => Val::Int((*all.get(row)?).into()),
        Column::Float(all) => Val::Float((*all.get(row)?).into()),
        Column::Vec2(all) => floats(&all.get(row)?.to_array()),
        Column::Vec3(all) => floats(&all.get(row)?.to_array()),
        Column::Vec4(all) => floats(&all.get(row)?.to_array()),
        _ => return None,
    })
}

/// By node: whether it has one of these names, or lies below one that has.
fn nodes(names: &[Name], scene: &Scene) -> Result<Vec<bool>, Diagnostic> {
    for name in names {
        if scene.nodes.iter().all(|n| n.name != name.value) {
            let d = Diagnostic::error(format!("the scene `{}` has no node `{}`", scene.name, name.value));
            return Err(d.at(&name.span, "").nearest(&name.value, scene.nodes.iter().map(|n| n.name.as_str())));
        }
    }
    let mut taken: Vec<bool> = vec![];
    for node in &scene.nodes {
        let below = node.parent.is_some_and(|parent| taken.get(parent) == Some(&true));
        taken.push(below || names.iter().any(|name| name.value == node.name));
    }
    Ok(taken)
}
