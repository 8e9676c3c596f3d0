// Counts the grains.
struct Grain {
    at: vec3f,
    count: u32,
#ifdef HEAVY
    weight: f32,
#endif
}
var<storage, read_write> grains: array<Grain>;

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&grains) {
        grains[id.x].count += 1u;
    }
}
