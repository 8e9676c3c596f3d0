//! Scene tables in the byte layout that a shader asks for.

use super::TableUse;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::scene::{Column, Table};
use crate::value::Type;

/// The rows in the byte layout that a shader asks for; one zeroed row for an empty table, and as many as an array of
/// fixed length has.
///
/// # Errors
/// The table lacks a column, or has it in another type; it has more rows than the array.
pub fn pack(wanted: &TableUse, table: &Table) -> Checked<Vec<u8>> {
    let stride = wanted.stride.max(wanted.row.size).max(4) as usize;
    let size = wanted.row.size as usize;
    let too_large = || Diagnostic::error(format!("table `{}` with {} rows is too large", wanted.table, table.rows));
    let length = wanted.rows.map_or(table.rows, |rows| rows as usize);
    if table.rows > length {
        let d = Diagnostic::error(format!(
            "table `{}` has {} rows, and the shader's array holds {length}",
            wanted.table, table.rows
        ));
        return Err(d.help("take the array's length from a definition that a fact of the scene gives").into());
    }
    let mut out = vec![0u8; stride.checked_mul(length.max(1)).ok_or_else(too_large)?];
    let mut faults: Vec<Diagnostic> = vec![];
    for member in &wanted.row.members {
        let column = table.columns.iter().find(|(n, _)| *n == member.name).map(|(_, c)| c);
        let places = out.chunks_exact_mut(stride).take(table.rows).map(|row| &mut row[member.offset as usize..size]);
        if !column.is_some_and(|c| write(c, member.ty, places)) {
            let (name, ty) = (&member.name, member.ty.wgsl());
            let d = Diagnostic::error(format!("table `{}` has no column `{name}` of type {ty}", wanted.table));
            faults.push(d.nearest(name, table.columns.iter().map(|(n, _)| *n)));
        }
    }
    Faults::check(faults, out)
}

/// Writes a column, each row to the start of its place; false where it is too short or does not fit the type.
fn write<'a>(column: &Column, ty: Type, places: impl Iterator<Item = &'a mut [u8]>) -> bool {
    match column {
        Column::Picked { from, picks, part } => {
            write_rows(from, ty, picks.iter().filter_map(|p| Some(*p.get(*part)? as usize)).zip(places))
        }
        column => write_rows(column, ty, places.enumerate()),
    }
}

/// Writes some rows of a column, each to the start of its place.
fn write_rows<'a>(column: &Column, ty: Type, mut rows: impl Iterator<Item = (usize, &'a mut [u8])>) -> bool {
    fn plain<'a, T: bytemuck::Pod>(from: &[T], mut rows: impl Iterator<Item = (usize, &'a mut [u8])>) -> bool {
        rows.all(|(row, to)| {
            from.get(row).map(|v| to[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(v))).is_some()
        })
    }
    match (column, ty) {
        (Column::Uint(v), Type::Uint) => plain(v, rows),
        (Column::Float(v), Type::Float) => plain(v, rows),
        (Column::Vec2(v), Type::Vec2) => plain(v, rows),
        (Column::Vec3(v), Type::Vec3) => plain(v, rows),
        (Column::Vec4(v), Type::Vec4) => plain(v, rows),
        (Column::Mat4(v), Type::Mat4) => plain(v, rows),
        (column, ty) => rows.all(|(row, to)| match column.get(row).and_then(|v| v.cast(ty)) {
            Some(v) => {
                let bytes = v.bytes();
                to[..bytes.len()].copy_from_slice(bytes);
                true
            }
            None => false,
        }),
    }
}
