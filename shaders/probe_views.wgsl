//! The view of each face of each probe's cube, for draws that leave out what it doesn't show.
#import lightgraph::cube::view_projection
#import lightgraph::probes
#import lightgraph::probe_views::{depths, high, low}
#ifdef LEAN
#import lightgraph::near
#endif

struct View {
    view_projection: mat4x4f,
}
var<storage, read_write> probe_views: array<View>;

#ifdef LEAN
/// Probes along x, y, z.
var<uniform> grid: vec3u;

/// A view that shows nothing: everything lies behind it.
const NOTHING: mat4x4f = mat4x4f(vec4f(0.0), vec4f(0.0), vec4f(0.0), vec4f(0.0, 0.0, 0.0, -1.0));

/// Whether a surface may lie in a cell that has the probe for a corner: only there is it read.
fn is_read(probe: vec3u) -> bool {
    // One cell to each side; what lies outside of the grid counts for its nearest face.
    let last = grid - 1u;
    let size = high() - low();
    let before = select(probes::position(max(probe, vec3u(1u)) - 1u), low() - size, probe == vec3u(0u));
    let after = select(probes::position(min(probe + 1u, last)), high() + size, probe == last);
    // Beyond rounding of a place in the grid.
    let margin = 1e-4 * size;
    return near::is_any_in(before - margin, after + margin);
}
#endif

@compute @workgroup_size(64)
fn place_views(@builtin(global_invocation_id) id: vec3u) {
    let member = id.x;
    if member >= arrayLength(&probe_views) {
        return;
    }
    let d = depths();
    let at = probes::coordinates(member / 6u);
#ifdef LEAN
    if !is_read(at) {
        probe_views[member].view_projection = NOTHING;
        return;
    }
#endif
    let probe = probes::position(at);
    probe_views[member].view_projection = view_projection(probe, member % 6u, d.x, d.y);
}
