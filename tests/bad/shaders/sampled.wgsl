// Reads an image through a sampler.
var before: texture_2d<f32>;
var smooth_sampler: sampler;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> Targets {
    return Targets(textureSampleLevel(before, smooth_sampler, at.xy, 0.0));
}
