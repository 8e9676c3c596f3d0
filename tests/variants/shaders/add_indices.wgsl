//! Adds the numbers of the repetitions and the loop around.
struct P { i: u32, j: u32, turn: u32 }
var<uniform> p: P;
var field: texture_storage_2d<r32float, read_write>;
@compute @workgroup_size(8, 8) fn add(@builtin(global_invocation_id) id: vec3u) {
    let v = textureLoad(field, id.xy).r;
    textureStore(field, id.xy, vec4f(v + f32(100u * p.i + 10u * p.j + p.turn)));
}
