struct Out { @location(0) kept: vec4f }

@fragment fn shade(@builtin(position) at: vec4f) -> Out { return Out(vec4f(at.x * 0.1, 0.1, 0.2, 1.0)); }
