//! Moves particles by a step of time, and says which of them glow.
#import lightgraph::random::{next, next_pair, scramble}
#import play::particle::Particle

var<storage, read_write> particles: array<Particle>;
/// 1 of those that are to be seen.
var<storage, read_write> glows: array<u32>;

struct Params {
    gravity: f32,
    step: f32,
    frame: u32,
    first_frame: u32,
}
var<uniform> params: Params;

/// Seconds that a spark glows, and that it rests until it flies again.
const LIFE: f32 = 3.0;
const REST: f32 = 1.0;

@compute @workgroup_size(64)
fn fly(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&particles) {
        return;
    }
    var p = particles[id.x];
    p.life -= params.step;
    if p.life <= -REST || params.first_frame != 0u {
        var state = scramble(id.x + scramble(params.frame));
        let turn = 6.2831853 * next(&state);
        let apart = next_pair(&state);
        p.position = vec2f(0.0, 0.05);
        p.velocity = vec2f(0.25 * sqrt(apart.x) * cos(turn), 1.3 + 0.3 * apart.y);
        p.color = mix(vec3f(1.0, 0.35, 0.08), vec3f(0.3, 0.5, 1.0), apart.y);
        p.life = LIFE;
        if params.first_frame != 0u {
            // A first frame has them everywhere on their way.
            let age = (LIFE + REST) * next(&state);
            p.life -= age;
            p.position = abs(p.position + (p.velocity - vec2f(0.0, 0.5 * params.gravity * age)) * age);
            p.position.x *= sign(cos(turn));
            p.velocity.y -= params.gravity * age;
        }
    }
    p.velocity.y -= params.gravity * params.step;
    p.position += p.velocity * params.step;
    if p.position.y < 0.0 {
        p.position.y = -p.position.y;
        p.velocity *= vec2f(0.7, -0.5);
    }
    particles[id.x] = p;
    glows[id.x] = u32(p.life > 0.0);
}
