//! Scene tables in the byte layout that a shader asks for.

use super::TableUse;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::scene::Table;

/// The rows in the byte layout that a shader asks for; one zeroed row for an empty table.
///
/// # Errors
/// The table lacks a column, or has it in another type.
pub fn pack(wanted: &TableUse, table: &Table) -> Checked<Vec<u8>> {
    let stride = wanted.stride.max(wanted.row.size).max(4) as usize;
    let size = wanted.row.size as usize;
    let too_large = || Diagnostic::error(format!("table `{}` with {} rows is too large", wanted.table, table.rows));
    let mut out = vec![0u8; stride.checked_mul(table.rows.max(1)).ok_or_else(too_large)?];
    let mut faults: Vec<Diagnostic> = vec![];
    for (row, bytes) in out.chunks_exact_mut(stride).take(table.rows).enumerate() {
        let value = |name: &str| table.columns.iter().find(|(n, _)| *n == name).and_then(|(_, c)| c.get(row));
        for member in wanted.row.pack(&mut bytes[..size], value) {
            faults.push(
                Diagnostic::error(format!(
                    "table `{}` has no column `{}` of type {}",
                    wanted.table,
                    member.name,
                    member.ty.wgsl()
                ))
                .nearest(&member.name, table.columns.iter().map(|(n, _)| *n)),
            );
        }
        // The same columns are missing from every row.
        if !faults.is_empty() {
            break;
        }
    }
    Faults::check(faults, out)
}
