//! The factors of the projection as a table: for coefficient k, face f and texel t, number (6k + f) * face² + t holds
//! what the texel counts. A table has no limit of layers, which high orders would pass.
#import lightgraph::projection
#import lightgraph::sh::COUNT

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
    var shares = projection::factors(id.x / (edge * edge), vec2u(id.x % edge, id.x / edge % edge), edge);
    for (var k = 0u; k < COUNT; k++) {
        factor_table[k * texels + id.x] = shares[k];
    }
}
