//! The scene's images, of any size, on pages that have no filter and no wrapping of their own: both are done here, as
//! glTF's samplers ask for them.
#define_import_path lightgraph::textures
#import lightgraph::srgb::decode

/// How a material reads an image; see the table `textures`.
struct Texture {
    /// Columns of a matrix, and what is added then.
    turn: vec4f,
    offset: vec2f,
    /// The first texel.
    x: u32,
    y: u32,
    layer: u32,
    width: u32,
    height: u32,
    levels: u32,
    flags: u32,
    /// Which of a vertex's coordinates.
    uv_set: u32,
}
var<storage, read> textures: array<Texture>;
var scene_textures: texture_2d_array<f32>;

/// No row of `textures`.
const NONE: u32 = 0xffffffffu;

const NEAR_NEAREST: u32 = 16u;
const FAR_NEAREST: u32 = 32u;
const COLOR: u32 = 256u;

/// Where a coordinate lies in an image that goes on beyond 0 to 1, as near to it as neighbours need.
fn inside(at: f32, wrap: u32) -> f32 {
    let repeated = at - floor(at);
    let mirrored = at - 2.0 * floor(0.5 * at);
    return select(select(mirrored, clamp(at, -1.0, 2.0), wrap == 1u), repeated, wrap == 0u);
}

/// A texel's number along an axis of `size`, for one that may lie beyond it.
fn wrapped(i: i32, size: i32, wrap: u32) -> u32 {
    let repeated = (i + 2 * size) % size;
    let twice = (i + 2 * size) % (2 * size);
    let mirrored = min(twice, 2 * size - 1 - twice);
    return u32(select(select(mirrored, clamp(i, 0, size - 1), wrap == 1u), repeated, wrap == 0u));
}

fn texel(t: Texture, corner: vec2u, size: vec2i, at: vec2i) -> vec4f {
    let place = vec2u(wrapped(at.x, size.x, t.flags & 3u), wrapped(at.y, size.y, t.flags >> 2u & 3u));
    let found = textureLoad(scene_textures, corner + place, t.layer, 0);
    if (t.flags & COLOR) != 0u {
        return vec4f(decode(found.rgb), found.a);
    }
    return found;
}

/// A mip at a coordinate that `inside` gave.
fn of_level(t: Texture, level: u32, at: vec2f, nearest: bool) -> vec4f {
    let whole = vec2u(t.width, t.height);
    let size = vec2i(max(whole >> vec2u(level), vec2u(1u)));
    // The second mip stands right of the first, each of the others below the one before it.
    var corner = vec2u(t.x, t.y);
    if level > 0u {
        corner.x += t.width;
        for (var i = 1u; i < level; i++) {
            corner.y += max(t.height >> i, 1u);
        }
    }
    let place = at * vec2f(size);
    if nearest {
        return texel(t, corner, size, vec2i(floor(place)));
    }
    let low = floor(place - 0.5);
    let share = place - 0.5 - low;
    let i = vec2i(low);
    let upper = mix(texel(t, corner, size, i), texel(t, corner, size, i + vec2i(1, 0)), share.x);
    let lower = mix(texel(t, corner, size, i + vec2i(0, 1)), texel(t, corner, size, i + vec2i(1, 1)), share.x);
    return mix(upper, lower, share.y);
}

/// A texture at a vertex's coordinate. `wide`: what the coordinate grows by from pixel to pixel along two axes, a
/// column each.
fn filtered(row: u32, uv: vec2f, wide: mat2x2f) -> vec4f {
    let t = textures[row];
    let turn = mat2x2f(t.turn.xy, t.turn.zw);
    let turned = turn * uv + t.offset;
    let at = vec2f(inside(turned.x, t.flags & 3u), inside(turned.y, t.flags >> 2u & 3u));
    let size = vec2f(vec2u(t.width, t.height));
    let x = size * (turn * wide[0]);
    let y = size * (turn * wide[1]);
    // Pixels are wider than texels by a power of two.
    let power = 0.5 * log2(max(max(dot(x, x), dot(y, y)), 1e-20));
    let far = power > 0.0;
    let nearest = (t.flags & select(NEAR_NEAREST, FAR_NEAREST, far)) != 0u;
    let between = t.flags >> 6u & 3u;
    var level = select(0.0, clamp(power, 0.0, f32(t.levels - 1u)), far && between != 0u);
    if between == 1u {
        level = floor(level + 0.5);
    }
    let low = floor(level);
    let found = of_level(t, u32(low), at, nearest);
    if level > low {
        return mix(found, of_level(t, u32(low) + 1u, at, nearest), level - low);
    }
    return found;
}

/// The mean of all texels.
fn mean(row: u32) -> vec4f {
    let t = textures[row];
    return of_level(t, t.levels - 1u, vec2f(0.5), true);
}
