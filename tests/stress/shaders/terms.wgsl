//! Numbers to be summed.
struct Params { alternate: u32 }
var<uniform> params: Params;
var terms: texture_storage_2d<rgba32float, write>;

/// Terms of magnitudes from 0.01 to 1.01, in no order.
fn term(index: u32, alternate: u32) -> f32 {
    let word = (index * 2654435761u) ^ (index >> 7u);
    let magnitude = f32(word >> 16u) / 65536.0 + 0.01;
    return select(magnitude, -magnitude, alternate == 1u && (index & 1u) == 1u);
}

@compute @workgroup_size(8, 8)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(terms);
    if all(id.xy < size) {
        textureStore(terms, id.xy, vec4f(term(id.y * size.x + id.x, params.alternate)));
    }
}
