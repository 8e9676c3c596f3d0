// What it imports imports itself.
#import bad::ring_a::a

@fragment
fn fragment() -> @location(0) vec4f {
    return vec4f(a());
}
