var<storage, read_write> counted: array<u32>;
@compute @workgroup_size(1) fn tell(@builtin(global_invocation_id) id: vec3u) { counted[id.x] = id.x + 1u; }
