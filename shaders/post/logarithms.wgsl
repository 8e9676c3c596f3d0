//! The logarithm of the luminance of every fourth pixel.
var hdr: texture_2d<f32>;
var logarithms: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn measure(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(logarithms)) {
        return;
    }
    let color = textureLoad(hdr, 2u * id.xy, 0).rgb;
    // 2^-20 is darker than anything that shows.
    let luminance = max(dot(color, vec3f(0.2126, 0.7152, 0.0722)), exp2(-20.0));
    textureStore(logarithms, id.xy, vec4f(log2(luminance)));
}
