//! A level of a texture from the one above: each texel is the mean of what it covers, of odd sides too.

#ifdef LAYERED
var above: texture_2d_array<f32>;
var<uniform> layer: u32;
#else
var above: texture_2d<f32>;
#endif

struct Half {
    @location(0) below: vec4f,
}

fn texel(at: vec2u) -> vec4f {
#ifdef LAYERED
    return textureLoad(above, at, layer, 0);
#else
    return textureLoad(above, at, 0);
#endif
}

@fragment
fn halve(@builtin(position) at: vec4f) -> Half {
    let size = textureDimensions(above);
    let half = max(size / 2u, vec2u(1u));
    // In parts of which a texel above has `half` along each axis, and one below `size`.
    let start = vec2u(at.xy) * size;
    let end = start + size;
    let first = start / half;
    let last = (end - 1u) / half;
    var sum = vec4f(0.0);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let place = vec2u(x, y);
            let covered = min(end, (place + 1u) * half) - max(start, place * half);
            let share = vec2f(covered) / vec2f(size);
            sum += share.x * share.y * texel(place);
        }
    }
    return Half(sum);
}
