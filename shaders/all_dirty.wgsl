//! Dirty bits of all instances: for changes of which nobody knows what they touch.
var<storage, read_write> bits: array<u32>;

@compute @workgroup_size(64)
fn all_dirty(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&bits) {
        bits[id.x] = 0xffffffffu;
    }
}
