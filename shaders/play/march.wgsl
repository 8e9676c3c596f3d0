//! Rays against a surface that is stated by its distance.
struct Params {
    time: f32,
    steps: u32,
    blend: f32,
    screen: vec2u,
}
var<uniform> params: Params;

struct Image {
    @location(0) color: vec4f,
}

fn melted(a: f32, b: f32) -> f32 {
    let share = clamp(0.5 + 0.5 * (b - a) / params.blend, 0.0, 1.0);
    return mix(b, a, share) - params.blend * share * (1.0 - share);
}

fn away(p: vec3f) -> f32 {
    var nearest = p.y + 0.15 * sin(2.0 * p.x) * sin(2.0 * p.z);
    for (var i = 0; i < 5; i++) {
        let angle = params.time * 0.5 + f32(i) * 1.2566;
        let middle = vec3f(cos(angle), 0.6 + 0.3 * sin(3.0 * angle + params.time), sin(angle));
        nearest = melted(nearest, length(p - middle) - 0.35);
    }
    return nearest;
}

fn normal(p: vec3f) -> vec3f {
    let e = vec2f(0.0005, -0.0005);
    return normalize(e.xyy * away(p + e.xyy) + e.yyx * away(p + e.yyx) + e.yxy * away(p + e.yxy) + e.xxx * away(p + e.xxx));
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Image {
    let screen = vec2f(params.screen);
    let on_plane = (2.0 * at.xy - screen) / screen.y * vec2f(1.0, -1.0);
    let eye = 3.5 * vec3f(cos(0.2 * params.time), 0.5, sin(0.2 * params.time));
    let forward = normalize(vec3f(0.0, 0.4, 0.0) - eye);
    let right = normalize(cross(forward, vec3f(0.0, 1.0, 0.0)));
    let ray = normalize(on_plane.x * right + on_plane.y * cross(right, forward) + 1.8 * forward);
    let sun = normalize(vec3f(0.6, 0.7, 0.2));
    let sky = mix(vec3f(0.6, 0.75, 0.95), vec3f(0.15, 0.3, 0.7), max(ray.y, 0.0));
    var t = 0.0;
    for (var i = 0u; i < params.steps && t < 30.0; i++) {
        let d = away(eye + t * ray);
        if d < 0.0005 * t {
            break;
        }
        t += 0.8 * d;
    }
    if t >= 30.0 {
        return Image(vec4f(sky, 1.0));
    }
    let p = eye + t * ray;
    let n = normal(p);
    var light = 1.0;
    var s = 0.02;
    for (var i = 0; i < 48 && s < 8.0; i++) {
        let d = away(p + 0.002 * n + s * sun);
        light = min(light, 12.0 * d / s);
        s += clamp(d, 0.01, 0.5);
    }
    let albedo = mix(vec3f(0.35, 0.4, 0.3), vec3f(0.8, 0.35, 0.25), smoothstep(0.1, 0.4, p.y));
    let lit = max(dot(n, sun), 0.0) * clamp(light, 0.0, 1.0) * vec3f(1.6, 1.45, 1.2) + (0.5 + 0.5 * n.y) * vec3f(0.2, 0.27, 0.38);
    return Image(vec4f(mix(sky, albedo * lit, exp(-0.002 * t * t)), 1.0));
}
