// A fragment whose value has no name.
@fragment
fn fragment() -> @location(0) vec4f {
    return vec4f(1.0);
}
