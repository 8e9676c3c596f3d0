//! A particle of a list as a soft spot, drawn out along its way.
#import play::particle::Particle

var<storage, read> particles: array<Particle>;
var<storage, read> list: array<u32>;

struct Params {
    radius: f32,
    step: f32,
    screen: vec2u,
}
var<uniform> params: Params;

struct Spot {
    @builtin(position) at: vec4f,
    /// From -1 to 1 in the spot.
    @location(0) corner: vec2f,
    @location(1) light: vec3f,
}

@vertex
fn place(@builtin(vertex_index) i: u32, @builtin(instance_index) instance: u32) -> Spot {
    let p = particles[list[instance]];
    let corner = vec2f(f32(i % 2u), f32(i / 2u)) * 2.0 - 1.0;
    // No thinner than a pixel, and as bright altogether.
    let radius = max(params.radius, 0.75 / f32(params.screen.y));
    let share = params.radius * params.radius / (radius * radius);
    let ahead = p.velocity / max(length(p.velocity), 1e-6);
    let aside = vec2f(-ahead.y, ahead.x);
    let reach = radius + 0.5 * params.step * length(p.velocity);
    let at = p.position + corner.x * radius * aside + corner.y * reach * ahead;
    let aspect = f32(params.screen.y) / f32(params.screen.x);
    let clip = vec2f(2.0 * at.x * aspect, 2.0 * at.y - 1.0);
    return Spot(vec4f(clip, 0.5, 1.0), corner, 0.12 * share * p.color * clamp(p.life, 0.0, 1.0));
}

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn shade(spot: Spot) -> Image {
    let left = max(1.0 - dot(spot.corner, spot.corner), 0.0);
    return Image(vec4f(left * left * spot.light, 1.0));
}
