// A condition without an end.
@fragment
fn fragment() -> @location(0) vec4f {
#ifdef DARK
    return vec4f(0.0);
}
