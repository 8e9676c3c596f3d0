// What it imports doesn't hold together.
#import bad::typed::doubled

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(doubled(1.0)));
}
