//! A step of Gauss's and Jordan's inversion in place, all channels at once. A bounce loses light, so the diagonal of
//! 1 - T outweighs what stands beside it, and no search for pivots is needed.

struct Params {
    /// The step.
    pivot: u32,
    /// Rows of the matrix.
    rounds: u32,
}
var<uniform> params: Params;
var<storage, read> pivot_row: array<vec4f>;
var<storage, read> pivot_column: array<vec4f>;
var<storage, read_write> matrix: array<vec4f>;

/// x: the column; y: the row.
@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.rounds || id.y >= params.rounds {
        return;
    }
    let row = pivot_row[id.x].rgb;
    let before = select(matrix[id.y * params.rounds + id.x].rgb, vec3f(0.0), id.x == params.pivot);
    let after = select(before - pivot_column[id.y].rgb * row, row, id.y == params.pivot);
    matrix[id.y * params.rounds + id.x] = vec4f(after, 0.0);
}
