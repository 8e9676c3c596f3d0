// Two colours, by a definition.
struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
#ifdef DARK
    return Targets(vec4f(0.0));
#else
    return Targets(vec4f(1.0));
#endif
}
