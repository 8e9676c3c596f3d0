// Linear light to the bytes of a display: one image, two side by side, or their difference.
// The twin of `image::png::to_bytes` and `image::difference::difference`.

struct Look {
    // Factor on the light.
    exposure: f32,
    // 0: cut off at 0 and 1; 1: Khronos PBR Neutral.
    tone_map: u32,
    // 0: the first alone; 1: the second right of `at`; 2: the difference, in full colour at `at`; 3: the second alone.
    arrangement: u32,
    at: f32,
}

@group(0) @binding(0) var<uniform> look: Look;
@group(0) @binding(1) var first: texture_2d<f32>;
@group(0) @binding(2) var second: texture_2d<f32>;

struct Seen { @builtin(position) position: vec4f, @location(0) at: vec2f }

@vertex fn cover(@builtin(vertex_index) i: u32) -> Seen {
    let at = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return Seen(vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, 0.0, 1.0), at);
}

fn texel(image: texture_2d<f32>, at: vec2f) -> vec3f {
    let size = textureDimensions(image);
    return textureLoad(image, min(vec2u(at * vec2f(size)), size - 1u), 0).rgb;
}

// Written on bits: a compiler may take `x != x` for false.
fn is_nan(c: vec3f) -> bool {
    return any((bitcast<vec3u>(c) & vec3u(0x7fffffffu)) > vec3u(0x7f800000u));
}

fn neutral(light: vec3f) -> vec3f {
    let start = 0.8 - 0.04;
    let lowest = min(light.r, min(light.g, light.b));
    let offset = select(0.04, lowest - 6.25 * lowest * lowest, lowest < 0.08);
    let color = light - offset;
    let peak = max(color.r, max(color.g, color.b));
    if peak < start { return color; }
    let d = 1.0 - start;
    let new_peak = 1.0 - d * d / (peak + d - start);
    let white = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(color * (new_peak / peak), vec3f(new_peak), white);
}

fn encode(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

fn shown(light: vec3f) -> vec3f {
    if is_nan(light) { return vec3f(1.0, 0.0, 1.0); }
    // An infinity would make the tone map divide it by itself.
    let exposed = clamp(light * look.exposure, vec3f(0.0), vec3f(1e30));
    if look.tone_map == 0u { return encode(exposed); }
    return encode(neutral(exposed));
}

fn differing(a: vec3f, b: vec3f) -> vec3f {
    if is_nan(a) || is_nan(b) { return vec3f(1.0, 0.0, 1.0); }
    let error = dot(a - b, vec3f(1.0 / 3.0)) / look.at;
    let rest = 1.0 - min(abs(error), 1.0);
    return encode(select(vec3f(rest, rest, 1.0), vec3f(1.0, rest, rest), error > 0.0));
}

@fragment fn display(seen: Seen) -> @location(0) vec4f {
    let a = texel(first, seen.at);
    let b = texel(second, seen.at);
    var color: vec3f;
    switch look.arrangement {
        case 1u: { color = shown(select(a, b, seen.at.x >= look.at)); }
        case 2u: { color = differing(a, b); }
        case 3u: { color = shown(b); }
        default: { color = shown(a); }
    }
    return vec4f(color, 1.0);
}
