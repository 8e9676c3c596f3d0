// Reads an image of integers.
var before: texture_2d<u32>;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(textureLoad(before, vec2u(0u), 0)));
}
