//! Before a step of the inversion: the pivot's row, divided by the pivot, and its column, as they are.

struct Params {
    /// The step.
    pivot: u32,
    /// Rows of the matrix.
    rounds: u32,
}
var<uniform> params: Params;
var<storage, read> matrix: array<vec4f>;
var<storage, read_write> pivot_row: array<vec4f>;
var<storage, read_write> pivot_column: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.rounds {
        return;
    }
    let start = params.pivot * params.rounds;
    let inverse = 1.0 / matrix[start + params.pivot].rgb;
    let row = select(matrix[start + id.x].rgb * inverse, inverse, id.x == params.pivot);
    pivot_row[id.x] = vec4f(row, 0.0);
    pivot_column[id.x] = matrix[id.x * params.rounds + params.pivot];
}
