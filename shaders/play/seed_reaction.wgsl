//! The first substance everywhere, with a few squares of the second one.
#import lightgraph::random::scramble

struct Out {
    @location(0) seeded: vec2f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Out {
    let cell = vec2u(at.xy) / 16u;
    let chance = scramble(cell.x + scramble(cell.y));
    return Out(select(vec2f(1.0, 0.0), vec2f(0.5), chance % 10u == 0u));
}
