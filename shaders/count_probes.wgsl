//! The number of probes in one texel: placed, and room for them.

/// For each probe its point; one more at the end: the number of probes.
var<storage, read> probe_points: array<u32>;
struct Params {
    room: u32,
    /// Numbers that there are for probes.
    probes: u32,
}
var<uniform> params: Params;

struct Count {
    @location(0) placed: vec4f,
}

@fragment
fn fragment() -> Count {
    return Count(vec4f(f32(probe_points[params.probes]), f32(params.room), 0.0, 0.0));
}
