//! A meadow: each blade a strip that bends in the wind.
#import lightgraph::random::{next, next_pair, scramble}

struct Params {
    wind: f32,
    time: f32,
    screen: vec2u,
}
var<uniform> params: Params;

struct Blade {
    @builtin(position) at: vec4f,
    @location(0) color: vec3f,
}

const FLOOR: f32 = 40.0;
const NEAR: f32 = 0.1;
const FAR: f32 = 60.0;

@vertex
fn place(@builtin(vertex_index) i: u32, @builtin(instance_index) instance: u32) -> Blade {
    var state = scramble(instance);
    let spread = next_pair(&state);
    // Denser where it is near, and as wide as the view there.
    let away = 1.0 + spread.y * spread.y * FLOOR;
    let root = vec3f((spread.x - 0.5) * (4.0 + 2.4 * away), 0.0, -away);
    let turn = 6.2831853 * next(&state);
    let tall = 0.35 + 0.35 * next(&state);
    let shade = next(&state);
    // 0 at the root, 1 at the tip.
    let up = f32(i / 2u) / 3.0;
    let side = (f32(i % 2u) - 0.5) * 0.05 * (1.0 - up);
    let gust = sin(0.6 * root.x + 1.7 * params.time) * sin(0.4 * root.z - 1.1 * params.time + 0.5 * sin(root.x));
    let lean = 0.12 * vec2f(cos(turn), sin(turn)) + params.wind * vec2f(0.3 + 0.25 * gust, 0.08 * gust);
    var at = root + vec3f(side * cos(turn), 0.0, side * sin(turn))
        + vec3f(lean.x, 0.0, lean.y) * up * up + vec3f(0.0, tall * up * (1.0 - 0.3 * up * dot(lean, lean)), 0.0);
    if instance == 0u {
        // The ground.
        at = vec3f((f32(i % 2u) - 0.5) * 4.0 * FLOOR, 0.0, -up * 1.1 * FLOOR);
    }
    let seen = at - vec3f(0.0, 1.4, 0.5);
    let back = seen.y * 0.12;
    let depth = -seen.z * 0.993 - back;
    let high = seen.y * 0.993 - seen.z * 0.12;
    let aspect = f32(params.screen.y) / f32(params.screen.x);
    let clip = vec4f(1.5 * seen.x * aspect, 1.5 * high, FAR / (FAR - NEAR) * (depth - NEAR), depth);
    let green = mix(vec3f(0.02, 0.07, 0.015), mix(vec3f(0.16, 0.34, 0.06), vec3f(0.38, 0.40, 0.10), shade), up);
    var lit = green * (1.0 + 0.5 * gust * up);
    if instance == 0u {
        lit = vec3f(0.03, 0.08, 0.02);
    }
    return Blade(clip, mix(vec3f(0.55, 0.70, 0.90), lit, exp(-0.03 * depth)));
}

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn shade(blade: Blade) -> Image {
    return Image(vec4f(blade.color, 1.0));
}
