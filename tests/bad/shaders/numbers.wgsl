// Counts up in a buffer.
var<storage, read_write> numbers: array<f32>;

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&numbers) {
        numbers[id.x] += 1.0;
    }
}
