#import made::made

var<uniform> member: u32;
var<storage, read_write> computed: array<f32>;

@compute @workgroup_size(8) fn compute(@builtin(global_invocation_id) id: vec3u) {
    computed[member * 32u + id.x] = dot(made(vec2f(id.xy)), vec4f(2.0));
}
