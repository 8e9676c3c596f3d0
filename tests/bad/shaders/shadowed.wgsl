// Compares with a depth image.
var before: texture_depth_2d;
var shadow_sampler: sampler_comparison;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Targets {
    return Targets(vec4f(textureSampleCompareLevel(before, shadow_sampler, at.xy, 0.5)));
}
