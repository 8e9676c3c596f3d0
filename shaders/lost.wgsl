//! The counts of surfaces without a probe in one texel: lost and all in the image, lost and all in the captured cubes.
var<storage, read> lost_counts: array<u32>;

struct Counts {
    @location(0) lost: vec4f,
}

@fragment
fn fragment() -> Counts {
    return Counts(vec4f(f32(lost_counts[0]), f32(lost_counts[1]), f32(lost_counts[2]), f32(lost_counts[3])));
}
