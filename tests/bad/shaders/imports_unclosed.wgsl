// What it imports lacks a semicolon.
#import bad::unclosed::doubled

@fragment
fn fragment() -> @location(0) vec4f {
    return vec4f(doubled(1.0));
}
