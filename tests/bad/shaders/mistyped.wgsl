// A value of the wrong type.
@fragment
fn fragment() -> @location(0) vec4f {
    let x: u32 = 1.5;
    return vec4f(f32(x));
}
