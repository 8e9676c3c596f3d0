//! What moved since the last frame, as views see it: for passes that write dirty bits.
#define_import_path lightgraph::moved

struct Box {
    /// Corners in the world; where `lower.x` is above `upper.x` nothing moved.
    lower: vec3f,
    upper: vec3f,
}
var<storage, read> moved: array<Box>;

/// The rows of `moved`.
const ROWS: u32 = 8u;

/// How far drawing may round a vertex, in texels: devices keep at least four bits of a texel's fraction.
const SNAP: f32 = 0.07;

/// What sums over a matrix may be off by, relative to their sizes.
const ROUNDING: f32 = 1e-6;

fn is_any(i: u32) -> bool {
    return moved[i].lower.x <= moved[i].upper.x;
}

/// Texels of a view whose centres a box may cover, from `first` up to and without `end`, and the box's least depth.
struct Covered {
    first: vec2u,
    end: vec2u,
    nearest: f32,
}

const NOTHING: Covered = Covered(vec2u(0u), vec2u(0u), 1.0);

/// Whether a box lies on the outer side of a plane for certain, rounding included.
fn outside(plane: vec4f, middle: vec3f, half: vec3f) -> bool {
    let reach = dot(abs(plane.xyz), half);
    let size = dot(abs(plane.xyz), abs(middle)) + abs(plane.w);
    return dot(plane.xyz, middle) + plane.w + reach < -1e-5 * (size + reach);
}

/// What row `i` may cover of a view of `size` texels. A box that reaches behind the eye may cover everything.
fn covered(view_projection: mat4x4f, size: vec2u, i: u32) -> Covered {
    let b = moved[i];
    if !is_any(i) {
        return NOTHING;
    }
    let rows = transpose(view_projection);
    let middle = 0.5 * (b.lower + b.upper);
    let half = 0.5 * (b.upper - b.lower);
    if outside(rows[0] + rows[3], middle, half) || outside(rows[3] - rows[0], middle, half)
        || outside(rows[1] + rows[3], middle, half) || outside(rows[3] - rows[1], middle, half)
        || outside(rows[2], middle, half) || outside(rows[3] - rows[2], middle, half) {
        return NOTHING;
    }
    let whole = Covered(vec2u(0u), size, 0.0);
    var low = vec3f(1e30);
    var high = vec3f(-1e30);
    for (var corner = 0u; corner < 8u; corner++) {
        let at = vec4f(select(b.lower, b.upper, (vec3u(corner) >> vec3u(0u, 1u, 2u) & vec3u(1u)) == vec3u(1u)), 1.0);
        let clip = at * rows;
        let off = vec4f(
            dot(abs(rows[0]), abs(at)), dot(abs(rows[1]), abs(at)), dot(abs(rows[2]), abs(at)), dot(abs(rows[3]), abs(at)),
        ) * ROUNDING;
        let w = clip.w - off.w;
        // What is not a number covers everything too.
        if !(w > 0.0) {
            return whole;
        }
        let least = clip.xyz - off.xyz;
        let most = clip.xyz + off.xyz;
        low = min(low, least / select(vec3f(clip.w + off.w), vec3f(w), least < vec3f(0.0)));
        high = max(high, most / select(vec3f(w), vec3f(clip.w + off.w), most < vec3f(0.0)));
    }
    // Texel i has its centre at i + 0.5; rows begin at the top.
    let count = vec2f(size);
    let begin = (0.5 * vec2f(low.x, -high.y) + 0.5) * count - 0.5 - SNAP;
    let last = (0.5 * vec2f(high.x, -low.y) + 0.5) * count - 0.5 + SNAP;
    if !(all(abs(begin) < vec2f(1e9)) && all(abs(last) < vec2f(1e9))) {
        return whole;
    }
    let first = vec2u(clamp(ceil(begin), vec2f(0.0), count));
    let end = vec2u(clamp(floor(last) + 1.0, vec2f(0.0), count));
    return Covered(first, max(first, end), max(low.z, 0.0));
}
