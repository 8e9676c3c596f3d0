//! How many probes were captured in this frame, and how many there are, in one texel.
var<storage, read> stale_count: array<u32>;
var<uniform> probes: u32;

struct Count {
    @location(0) captured: vec4f,
}

@fragment
fn fragment() -> Count {
    return Count(vec4f(f32(stale_count[0]), f32(probes), 0.0, 0.0));
}
