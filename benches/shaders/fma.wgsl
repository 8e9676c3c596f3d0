//! Eight chains of multiply-adds, so that none waits for itself.
var<uniform> steps: u32;
var<storage, read_write> values: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    var a = vec4f(f32(id.x));
    var b = a + 1.0;
    let m = vec4f(0.999);
    let n = vec4f(0.5);
    for (var i = 0u; i < steps; i++) {
        a = fma(a, m, n);
        b = fma(b, m, n);
        a = fma(a, m, n);
        b = fma(b, m, n);
        a = fma(a, m, n);
        b = fma(b, m, n);
        a = fma(a, m, n);
        b = fma(b, m, n);
    }
    let sum = a + b;
    values[id.x] = sum.x + sum.y + sum.z + sum.w;
}
