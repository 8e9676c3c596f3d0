//! Lays out scene tables as a shader's struct asks, and hashes what a scene contributes to a plan. Needs no device.

use super::{Action, Binding, DrawGeometry, Plan, TableUse};
use crate::content::hash;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::graph::Graph;
use crate::scene::{
    AssetHashes, Column, FACTS, Follows, NodeMatrix, Pieces, Table, Transforms, VertexAttribute, table,
};
use crate::shader::Member;
use crate::unused::mentioned;
use crate::value::Type;
use std::ops::Range;

/// Texels of a line of a table in a texture.
pub const ACROSS: u32 = 4096;

/// Bytes of a texel: four words.
pub const TEXEL: usize = 16;

/// Bytes of a line.
const LINE: usize = ACROSS as usize * TEXEL;

/// The rows in the byte layout that a shader asks for, as [`write_rows`] writes them; one zeroed row for an empty table,
/// and as many as an array of fixed length has.
///
/// # Errors
/// The table lacks a column, or has it in another type; it has more rows than the array.
pub fn pack(wanted: &TableUse, table: &Table) -> Checked<Vec<u8>> {
    let stride = stride(wanted);
    let too_large = || Diagnostic::error(format!("table `{}` with {} rows is too large", wanted.table, table.rows));
    let length = wanted.rows.map_or(table.rows, |rows| rows as usize);
    if wanted.texels {
        // Whole lines of texels: what is left of the last is zero.
        let lines = (stride * length.max(1)).div_ceil(LINE);
        let mut out = vec![0u8; lines.checked_mul(LINE).ok_or_else(too_large)?];
        write_rows(wanted, table, 0..table.rows, &mut out)?;
        return Ok(out);
    }
    if table.rows > length {
        let d = Diagnostic::error(format!(
            "table `{}` has {} rows, and the shader's array holds {length}",
            wanted.table, table.rows
        ));
        return Err(d.help("take the array's length from a definition that a fact of the scene gives").into());
    }
    let mut out = vec![0u8; stride.checked_mul(length.max(1)).ok_or_else(too_large)?];
    write_rows(wanted, table, 0..table.rows, &mut out)?;
    Ok(out)
}

/// Bytes from row to row.
pub fn stride(wanted: &TableUse) -> usize {
    wanted.stride.max(wanted.row.size).max(4) as usize
}

/// Writes some rows as a shader asks, the first to the start of `out`. Leaves bytes that no member fills, and
/// [`Derived`] members: the device writes those.
///
/// # Errors
/// The table lacks a column, or has it in another type.
pub fn write_rows(wanted: &TableUse, table: &Table, some: Range<usize>, out: &mut [u8]) -> Checked<()> {
    let (stride, size) = (stride(wanted), wanted.row.size as usize);
    let mut faults: Vec<Diagnostic> = vec![];
    for member in wanted.row.members.iter().filter(|member| derived(wanted, table, member).is_none()) {
        let places = out.chunks_exact_mut(stride).take(some.len()).map(|row| &mut row[member.offset as usize..size]);
        let column = table.column(&member.name);
        if !column.is_some_and(|c| write(c, member.ty, some.start, places)) {
            let (name, ty) = (&member.name, member.ty.wgsl());
            let d = Diagnostic::error(format!("table `{}` has no column `{name}` of type {ty}", wanted.table));
            faults.push(d.nearest(name, table.columns.iter().map(|(n, _)| *n)));
        }
    }
    Faults::check(faults, ())
}

/// What the device works out of where nodes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Derived {
    /// A vertex attribute in world space, at a corner of a triangle.
    Corner(VertexAttribute, usize),
    Node(NodeMatrix),
    /// A corner of a hierarchy's box.
    Lower,
    Upper,
}

/// What the device writes to a member; `None`: the host does.
pub fn derived(wanted: &TableUse, table: &Table, member: &Member) -> Option<Derived> {
    let upper = |member: &Member| match table.column(&member.name) {
        Some(Column::Box { upper, .. }) if member.ty == Type::Vec3 => Some(*upper),
        _ => None,
    };
    match table.column(&member.name)? {
        Column::Corner { corner, held, .. } if held.in_world_space() && held.ty() == member.ty => {
            Some(Derived::Corner(*held, *corner))
        }
        Column::Node { matrix, .. } if member.ty == Type::Mat4 => Some(Derived::Node(*matrix)),
        // Boxes are made of boxes: whole ones.
        Column::Box { .. } if wanted.row.members.iter().filter_map(upper).count() == 2 => {
            upper(member).map(|upper| if upper { Derived::Upper } else { Derived::Lower })
        }
        _ => None,
    }
}

/// Whether the device writes members of a table's rows.
pub fn has_derived(wanted: &TableUse, table: &Table) -> bool {
    wanted.row.members.iter().any(|member| derived(wanted, table, member).is_some())
}

/// Writes a column from row number `first` on, each row to the start of its place; false where it is too short or does
/// not fit the type.
fn write<'a>(column: &Column, ty: Type, first: usize, places: impl Iterator<Item = &'a mut [u8]>) -> bool {
    match (column, ty) {
        (Column::Uint(v), Type::Uint) => fill(v, first, places),
        (Column::Float(v), Type::Float) => fill(v, first, places),
        (Column::Vec2(v), Type::Vec2) => fill(v, first, places),
        (Column::Vec3(v), Type::Vec3) => fill(v, first, places),
        (Column::Vec4(v), Type::Vec4) => fill(v, first, places),
        (Column::Mat4(v), Type::Mat4) => fill(v, first, places),
        (column, ty) => places.enumerate().all(|(row, to)| match column.get(first + row).and_then(|v| v.cast(ty)) {
            Some(v) => {
                let bytes = v.bytes();
                to[..bytes.len()].copy_from_slice(bytes);
                true
            }
            None => false,
        }),
    }
}

/// Writes values from one on, each to the start of its place; false where there are too few.
fn fill<'a, T: bytemuck::Pod>(
    values: &Pieces<T>,
    first: usize,
    mut places: impl Iterator<Item = &'a mut [u8]>,
) -> bool {
    for slice in values.slices(first..values.len()) {
        for (value, to) in slice.iter().zip(&mut places) {
            to[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
    }
    places.next().is_none()
}

/// What the scene gives to a plan, hashed.
#[derive(Debug, Clone, Default)]
pub struct SceneInputs {
    pub assets: AssetHashes,
    /// How many frames came before the plan's first.
    pub began: u32,
    /// How many frames came before this one.
    pub frame: u32,
    /// By index of [`Plan::tables`].
    pub(super) tables: Vec<u128>,
}

impl SceneInputs {
    /// # Errors
    /// A table that lacks a column; the planner has checked that, so it is a fault of the caller.
    pub fn new(plan: &Plan, assets: AssetHashes, began: u32, tables: &[Table]) -> Checked<SceneInputs> {
        let mut inputs = SceneInputs { assets, began, frame: began, tables: vec![0; plan.tables.len()] };
        inputs.follow(plan, &[], tables)?;
        Ok(inputs)
    }

    /// Goes on from the tables `before` to others of the same scene; those that are the same cost nothing.
    ///
    /// # Errors
    /// As [`SceneInputs::new`].
    pub fn follow(&mut self, plan: &Plan, before: &[Table], tables: &[Table]) -> Checked<()> {
        let AssetHashes { geometry, order, .. } = self.assets;
        let places = tables.iter().find_map(Table::places);
        let levels: Vec<u128> = plan.levels.iter().map(|level| level.key).collect();
        for (wanted, hashed) in plan.tables.iter().zip(&mut self.tables) {
            let Some(found) = tables.iter().find(|t| t.name == wanted.table) else { continue };
            if before.iter().any(|b| b.is_clone(found)) {
                continue;
            }
            let columns: Vec<_> = wanted.row.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
            let layout = (found.name, &columns, wanted.stride, wanted.rows, wanted.texels);
            *hashed = match (places, table(found.name)) {
                (Some(places), Some(t)) if t.large => {
                    let triangles = t.follows.contains(Follows::TRIANGLES).then_some((geometry, order));
                    let levels = t.follows.contains(Follows::LEVELS).then_some(&levels);
                    let earlier = earlier_places(wanted, found).map(Transforms::key);
                    hash(&(places.key(), earlier, triangles, levels, layout))
                }
                _ => hash(&pack(wanted, found)?),
            };
        }
        Ok(())
    }
}

/// Where nodes were, where a row holds that.
pub fn earlier_places<'a>(wanted: &TableUse, table: &'a Table) -> Option<&'a Transforms> {
    let earlier = NodeMatrix::PreviousTransform;
    let mut members = wanted.row.members.iter();
    members.find(|m| derived(wanted, table, m) == Some(Derived::Node(earlier))).and(table.matrices(earlier))
}

/// What a plan takes from the scene, if anything: what it draws, reads or counts of it. A camera is no part of it.
pub fn scene_use(graph: &Graph, plan: &Plan) -> Option<String> {
    let is_fact = |name: &str| FACTS.iter().any(|f| f.0 == name);
    let mut facts: Vec<&str> = mentioned(graph).into_iter().filter(|name| is_fact(name)).collect();
    facts.sort_unstable();
    let by_step = plan.steps.iter().find_map(|step| {
        let name = &step.pass;
        if matches!(&step.action, Action::Draw(draw) if matches!(draw.geometry, DrawGeometry::Scene { .. })) {
            return Some(format!("`{name}` draws one"));
        }
        step.bindings.iter().find_map(|binding| match binding {
            Binding::Table(table) => Some(format!("`{name}` reads the table `{}`", plan.tables.get(*table)?.table)),
            Binding::SceneTextures => Some(format!("`{name}` reads the textures of one")),
            Binding::Uniform { layout, .. } => {
                let fact = layout.members.iter().find(|m| is_fact(&m.name))?;
                Some(format!("`{name}` asks for its `{}`", fact.name))
            }
            _ => None,
        })
    });
    by_step.or_else(|| facts.first().map(|fact| format!("the graph asks for its `{fact}`")))
}
