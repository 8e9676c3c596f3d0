//! YᵀAY for least-squares projection: Y the harmonics at the centres of a cube's texels, A their solid angles.
#import lightgraph::cube::{direction, solid_angle}
#import lightgraph::sh::{COUNT, basis}

struct Params {
    /// Texels along a face.
    face: u32,
}
var<uniform> params: Params;
var<storage, read_write> gram: array<f32>;

const LANES: u32 = 64u;
var<workgroup> partial: array<f32, LANES>;

/// A workgroup for the product of two functions; sums in a fixed order, so every run gives the same bits.
@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) pair: vec3u, @builtin(local_invocation_index) lane: u32) {
    let edge = params.face;
    var sum = 0.0;
    for (var t = lane; t < 6u * edge * edge; t += LANES) {
        let texel = vec2u(t % edge, t / edge % edge);
        var y = basis(direction(t / (edge * edge), texel, edge));
        sum += y[pair.x] * y[pair.y] * solid_angle(texel, edge);
    }
    partial[lane] = sum;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            partial[lane] += partial[lane + half];
        }
    }
    if lane == 0u {
        gram[pair.x * COUNT + pair.y] = partial[0];
    }
}
