//! A step of Gauss's and Jordan's inversion in place, all channels at once. A bounce loses light, so the diagonal of
//! 1 - T outweighs what stands beside it, and no search for pivots is needed.

struct Params {
    /// The step.
    pivot: u32,
    /// Rows of the matrix.
    rounds: u32,
}
var<uniform> params: Params;
/// See take_pivot.wgsl.
var pivot_row: texture_storage_2d<rgba32float, read>;
var pivot_column: texture_storage_2d<rgba32float, read>;
var<storage, read_write> matrix: array<vec4f>;

/// Rows of an invocation.
const ROWS: u32 = 8u;

/// x: the column; y: the run of rows.
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.rounds {
        return;
    }
    let row = textureLoad(pivot_row, vec2u(id.x, 0u)).rgb;
    let kept = select(1.0, 0.0, id.x == params.pivot);
    let end = min(ROWS * (id.y + 1u), params.rounds);
    for (var y = ROWS * id.y; y < end; y++) {
        let place = y * params.rounds + id.x;
        let rest = kept * matrix[place].rgb - textureLoad(pivot_column, vec2u(y, 0u)).rgb * row;
        matrix[place] = vec4f(select(rest, row, y == params.pivot), 0.0);
    }
}
