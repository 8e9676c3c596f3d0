//! Dirty bits of probes whose cube shows something else: one of their six faces was captured again.
var<storage, read> face_dirty: array<u32>;
var<storage, read_write> surface_dirty: array<atomic<u32>>;
/// Probes along x, y, z.
var<uniform> grid: vec3u;

@compute @workgroup_size(64)
fn dirty_surface(@builtin(global_invocation_id) id: vec3u) {
    let probe = id.x;
    if probe >= grid.x * grid.y * grid.z {
        return;
    }
    var any = 0u;
    for (var face = 6u * probe; face < 6u * probe + 6u; face++) {
        any |= face_dirty[face / 32u] >> (face % 32u) & 1u;
    }
    atomicOr(&surface_dirty[probe / 32u], any << (probe % 32u));
}
