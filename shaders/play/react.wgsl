//! A step of time of two substances: `before` holds how much of each there is.
var before: texture_2d<f32>;

struct Params {
    feed: f32,
    kill: f32,
}
var<uniform> params: Params;

struct Out {
    @location(0) after: vec2f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Out {
    let pixel = vec2i(at.xy);
    let size = vec2i(textureDimensions(before));
    let here = textureLoad(before, pixel, 0).xy;
    var around = vec2f(0.0);
    for (var i = 0; i < 9; i++) {
        let step = vec2i(i % 3 - 1, i / 3 - 1);
        let weight = select(0.05, 0.2, step.x * step.y == 0) * f32(i != 4);
        around += weight * textureLoad(before, (pixel + step + size) % size, 0).xy;
    }
    let spread = vec2f(1.0, 0.5) * (around - here);
    let made = here.x * here.y * here.y;
    let change = vec2f(params.feed * (1.0 - here.x) - made, made - (params.kill + params.feed) * here.y);
    return Out(clamp(here + spread + change, vec2f(0.0), vec2f(1.0)));
}
