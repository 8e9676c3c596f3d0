//! Hierarchical warping: a place in the unit square is drawn by numbers of its parts, from the coarsest square to the
//! finest, each time one of four quarters (Clarberg et al., "Wavelet Importance Sampling", 2005).
#define_import_path lightgraph::quarters

/// One of four.
struct Quarter {
    /// Right and lower are 1.
    at: vec2u,
    /// What is left of the pair, even again.
    pair: vec2f,
    /// Its number.
    own: f32,
}

/// One of four by their numbers, row by row, from a pair of even numbers.
fn quarter(four: vec4f, pair: vec2f) -> Quarter {
    let left = share_of(four.x + four.z, four.y + four.w);
    let right = pair.x >= left;
    let column = select(four.xz, four.yw, right);
    let top = share_of(column.x, column.y);
    let lower = pair.y >= top;
    let x = select(pair.x / max(left, 1e-20), (pair.x - left) / max(1.0 - left, 1e-20), right);
    let y = select(pair.y / max(top, 1e-20), (pair.y - top) / max(1.0 - top, 1e-20), lower);
    let rest = clamp(vec2f(x, y), vec2f(0.0), vec2f(0.99999994));
    return Quarter(vec2u(u32(right), u32(lower)), rest, select(column.x, column.y, lower));
}

/// What one is of the sum of both.
fn share_of(one: f32, other: f32) -> f32 {
    let sum = one + other;
    return select(0.5, one / sum, sum > 0.0);
}
