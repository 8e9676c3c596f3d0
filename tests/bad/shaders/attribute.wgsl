// Asks vertices for what they don't have, and for one of another type.
@vertex
fn vertex(@location(0) positon: vec3f, @location(1) normal: vec2f) -> @builtin(position) vec4f {
    return vec4f(positon + vec3f(normal, 0.0), 1.0);
}
