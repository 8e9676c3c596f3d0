//! Dirty bits of views: one is set where something that moved shows, or showed, in the view. With FAR the view's texels
//! hold depths as they were drawn last: what lies behind them doesn't show.
#import lightgraph::moved::{ROWS, covered}

struct View {
    view_projection: mat4x4f,
}
var<storage, read> views: array<View>;
var<storage, read_write> bits: array<atomic<u32>>;

/// Texels along a view.
const VIEW_SIZE: u32 = #{VIEW_SIZE}u;

#ifdef FAR
/// Depths, 0 to 1; a tile a view.
var cube_far: texture_2d<f32>;

/// What depths may be off by.
const DEPTH_ROUNDING: f32 = 1e-5;

fn is_hidden(view: u32, first: vec2u, end: vec2u, nearest: f32) -> bool {
    let columns = textureDimensions(cube_far).x / VIEW_SIZE;
    let corner = vec2u(view % columns, view / columns) * VIEW_SIZE;
    for (var y = first.y; y < end.y; y++) {
        for (var x = first.x; x < end.x; x++) {
            if textureLoad(cube_far, corner + vec2u(x, y), 0).x + DEPTH_ROUNDING >= nearest {
                return false;
            }
        }
    }
    return true;
}
#endif

@compute @workgroup_size(64)
fn moved_views(@builtin(global_invocation_id) id: vec3u) {
    let view = id.x;
    if view >= arrayLength(&views) {
        return;
    }
    let view_projection = views[view].view_projection;
    for (var i = 0u; i < ROWS; i++) {
        let c = covered(view_projection, vec2u(VIEW_SIZE), i);
        if any(c.first >= c.end) {
            continue;
        }
#ifdef FAR
        if is_hidden(view, c.first, c.end, c.nearest) {
            continue;
        }
#endif
        atomicOr(&bits[view / 32u], 1u << (view % 32u));
        return;
    }
}
