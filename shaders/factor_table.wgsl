//! The factors of the projection as a table: for coefficient k, face f and texel t, number (6k + f) * face² + t holds
//! Y_k(direction) times the solid angle. A table has no limit of layers, which high orders would pass.
#import lightgraph::cube::{direction, solid_angle}
#import lightgraph::sh::{COUNT, basis}

struct Params {
    /// Texels along a face.
    face: u32,
}
var<uniform> params: Params;
var<storage, read_write> factor_table: array<f32>;

@compute @workgroup_size(64)
fn factors(@builtin(global_invocation_id) id: vec3u) {
    let edge = params.face;
    let texels = 6u * edge * edge;
    if id.x >= texels {
        return;
    }
    let side = id.x / (edge * edge);
    let texel = vec2u(id.x % edge, id.x / edge % edge);
    var middle = basis(direction(side, texel, edge));
    let area = solid_angle(texel, edge);
    // From degree 4 on a finer sum within the texel keeps constant light out of the higher coefficients, as in the
    // factor textures.
    var finer: array<f32, COUNT>;
    for (var i = 0u; i < 16u; i++) {
        let part = texel * 4u + vec2u(i % 4u, i / 4u);
        var y = basis(direction(side, part, edge * 4u));
        for (var k = 16u; k < COUNT; k++) {
            finer[k] += y[k] * solid_angle(part, edge * 4u);
        }
    }
    for (var k = 0u; k < COUNT; k++) {
        factor_table[k * texels + id.x] = select(finer[k], middle[k] * area, k < 16u);
    }
}
