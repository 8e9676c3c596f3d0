//! Before a step of the inversion: the pivot's row, divided by the pivot, and its column, as they are.

struct Params {
    /// The step.
    pivot: u32,
    /// Rows of the matrix.
    rounds: u32,
}
var<uniform> params: Params;
var<storage, read> matrix: array<vec4f>;
var pivot_row: texture_storage_2d<rgba32float, write>;
var pivot_column: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.rounds {
        return;
    }
    let start = params.pivot * params.rounds;
    let inverse = 1.0 / matrix[start + params.pivot].rgb;
    let row = select(matrix[start + id.x].rgb * inverse, inverse, id.x == params.pivot);
    textureStore(pivot_row, vec2u(id.x, 0u), vec4f(row, 0.0));
    textureStore(pivot_column, vec2u(id.x, 0u), matrix[id.x * params.rounds + params.pivot]);
}
