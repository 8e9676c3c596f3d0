//! A buffer in a uniform.
var<uniform> rows: array<vec4f, #{ROWS}>;
var image: texture_storage_2d<r32float, write>;

@compute @workgroup_size(1)
fn look(@builtin(global_invocation_id) id: vec3u) {
    textureStore(image, id.xy, rows[id.x]);
}
