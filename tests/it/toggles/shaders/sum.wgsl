#import made::made

var source: texture_2d<f32>;
var result: texture_storage_2d<r32float, write>;

@compute @workgroup_size(4, 4) fn compute(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(result)) { return; }
    let side = textureDimensions(source) / textureDimensions(result);
    var all = 0.0;
    for (var y = 0u; y < side.y; y++) {
        for (var x = 0u; x < side.x; x++) {
            let one = textureLoad(source, id.xy * side + vec2u(x, y), 0).x;
            all = all + one;
        }
    }
    textureStore(result, id.xy, vec4f(all + dot(made(vec2f(1.0)), vec4f(1.0))));
}
