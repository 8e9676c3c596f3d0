// A workgroup larger than adapters must allow.
var<storage, read_write> numbers: array<f32>;

@compute @workgroup_size(4096)
fn count(@builtin(global_invocation_id) id: vec3u) {
    numbers[id.x] = 1.0;
}
