// Asks for a definition that the graph doesn't give.
@fragment
fn fragment() -> @location(0) vec4f {
#if ORDER == 2
    return vec4f(0.0);
#endif
    return vec4f(f32(#{ORDR}));
}
