//! Sums over squares of eight by eight texels.
var source: texture_2d<f32>;
var result: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn add_up(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(result)) {
        return;
    }
    let corner = 8u * id.xy;
    let end = min(corner + 8u, textureDimensions(source));
    var sum = 0.0;
    for (var y = corner.y; y < end.y; y++) {
        for (var x = corner.x; x < end.x; x++) {
            sum += textureLoad(source, vec2u(x, y), 0).r;
        }
    }
    textureStore(result, id.xy, vec4f(sum));
}
