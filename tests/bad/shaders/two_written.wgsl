var<storage, read_write> a: array<u32>;
var<storage, read_write> b: array<u32>;

@compute @workgroup_size(4)
fn two(@builtin(global_invocation_id) id: vec3u) {
    a[id.x] = id.x;
    b[id.x] = id.x;
}
