@vertex
fn place(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i % 2u), f32(i / 2u), 0.5, 1.0);
}

@fragment
fn shade() -> @location(0) vec4f {
    return vec4f(1.0);
}
