//! Scene tables in the byte layout that a shader asks for.

use super::TableUse;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::scene::{Column, Table, VertexAttribute};
use crate::value::Type;
use std::ops::Range;

/// Texels of a line of a table in a texture.
pub const ACROSS: u32 = 4096;

/// Bytes of a texel: four words.
pub const TEXEL: usize = 16;

/// Bytes of a line.
const LINE: usize = ACROSS as usize * TEXEL;

/// The rows in the byte layout that a shader asks for; one zeroed row for an empty table, and as many as an array of
/// fixed length has.
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
        rows(wanted, table, 0..table.rows, &mut out)?;
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
    rows(wanted, table, 0..table.rows, &mut out)?;
    Ok(out)
}

/// Bytes from row to row.
pub fn stride(wanted: &TableUse) -> usize {
    wanted.stride.max(wanted.row.size).max(4) as usize
}

/// Writes some of the rows, the first of them to the start of `out`.
///
/// # Errors
/// The table lacks a column, or has it in another type.
pub fn rows(wanted: &TableUse, table: &Table, some: Range<usize>, out: &mut [u8]) -> Checked<()> {
    let (stride, size) = (stride(wanted), wanted.row.size as usize);
    let mut faults: Vec<Diagnostic> = vec![];
    for member in &wanted.row.members {
        let column = table.column(&member.name);
        let places = out.chunks_exact_mut(stride).take(some.len()).map(|row| &mut row[member.offset as usize..size]);
        if !column.is_some_and(|c| write(c, member.ty, some.start, places)) {
            let (name, ty) = (&member.name, member.ty.wgsl());
            let d = Diagnostic::error(format!("table `{}` has no column `{name}` of type {ty}", wanted.table));
            faults.push(d.nearest(name, table.columns.iter().map(|(n, _)| *n)));
        }
    }
    Faults::check(faults, ())
}

/// Writes a column from row number `first` on, each row to the start of its place; false where it is too short or does
/// not fit the type.
fn write<'a>(column: &Column, ty: Type, first: usize, places: impl Iterator<Item = &'a mut [u8]>) -> bool {
    match (column, ty) {
        (Column::Uint(v), Type::Uint) => fill(v.iter_from(first).copied(), places),
        (Column::Float(v), Type::Float) => fill(v.iter_from(first).copied(), places),
        (Column::Vec2(v), Type::Vec2) => fill(v.iter_from(first).copied(), places),
        (Column::Vec3(v), Type::Vec3) => fill(v.iter_from(first).copied(), places),
        (Column::Vec4(v), Type::Vec4) => fill(v.iter_from(first).copied(), places),
        (Column::Mat4(v), Type::Mat4) => fill(v.iter_from(first).copied(), places),
        (Column::Corner { of, corner, held: VertexAttribute::Position }, Type::Vec3) => {
            fill((first..of.rows()).map(|row| of.position(of.vertex(row, *corner))), places)
        }
        (Column::Corner { of, corner, held: VertexAttribute::Normal }, Type::Vec3) => {
            fill((first..of.rows()).map(|row| of.normal(of.vertex(row, *corner))), places)
        }
        (Column::Corner { of, corner, held: VertexAttribute::Uv }, Type::Vec2) => {
            fill((first..of.rows()).map(|row| of.vertex(row, *corner).uv), places)
        }
        (Column::Corner { of, corner, held: VertexAttribute::Material }, Type::Uint) => {
            fill((first..of.rows()).map(|row| of.vertex(row, *corner).material), places)
        }
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

/// Writes values, each to the start of its place; false where there are too few.
fn fill<'a, T: bytemuck::Pod>(
    mut values: impl Iterator<Item = T>,
    mut places: impl Iterator<Item = &'a mut [u8]>,
) -> bool {
    places.all(|to| values.next().map(|v| to[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(&v))).is_some())
}
