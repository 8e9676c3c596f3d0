//! A buffer in a uniform, and one that is written.
var<uniform> rows: array<vec4f, 8>;
var<storage, read_write> turned: array<vec4f>;

@compute @workgroup_size(1)
fn turn(@builtin(global_invocation_id) id: vec3u) {
    turned[id.x] = rows[7u - id.x];
}
