var<storage, read_write> bits: array<u32>;
@compute @workgroup_size(64) fn mark(@builtin(global_invocation_id) id: vec3u) {
    bits[id.x] = 1u;
}
