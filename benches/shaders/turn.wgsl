//! Some work on every value of a buffer.
struct Params {
    member: u32,
    work: u32,
}
var<uniform> params: Params;
var<storage, read_write> values: array<f32>;

@compute @workgroup_size(64)
fn turn(@builtin(global_invocation_id) id: vec3u) {
    var v = values[id.x] + f32(params.member & 1u);
    for (var i = 0u; i < params.work; i++) {
        v = fma(v, 0.999, 0.5);
    }
    values[id.x] = v;
}
