//! (YᵀAY)⁻¹ for least-squares projection.
#import lightgraph::sh::COUNT

/// YᵀAY, row by row.
var<storage, read> gram: array<f32>;
var<storage, read_write> inverse_gram: array<f32>;

const LANES: u32 = 128u;
/// The diagonal is near 1 where the texels tell a function from those before it; below this they don't, and its
/// coefficient is left at 0.
const TOLD_APART: f32 = 1e-3;

var<workgroup> row: array<f32, COUNT>;
var<workgroup> column: array<f32, COUNT>;

/// One workgroup: Gauss's and Jordan's elimination; a symmetric positive matrix needs no search for pivots.
@compute @workgroup_size(LANES)
fn main(@builtin(local_invocation_index) lane: u32) {
    for (var e = lane; e < COUNT * COUNT; e += LANES) {
        inverse_gram[e] = gram[e];
    }
    for (var p = 0u; p < COUNT; p++) {
        storageBarrier();
        for (var k = lane; k < COUNT; k += LANES) {
            row[k] = inverse_gram[p * COUNT + k];
            column[k] = inverse_gram[k * COUNT + p];
        }
        workgroupBarrier();
        let told = row[p] > TOLD_APART;
        let inverse = select(0.0, 1.0 / max(row[p], TOLD_APART), told);
        for (var e = lane; e < COUNT * COUNT; e += LANES) {
            let i = e / COUNT;
            let j = e % COUNT;
            let rest = inverse_gram[e] - column[i] * row[j] * inverse;
            let on_row = select(row[j] * inverse, inverse, j == p);
            inverse_gram[e] = select(select(rest, -column[i] * inverse, j == p), on_row, i == p);
        }
        workgroupBarrier();
    }
}
