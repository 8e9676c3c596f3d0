//! The image of a scene that stays as it is: what the frame gathered counts as so many paths, and paths take its
//! place as they come.
struct Progress {
    paths: u32,
    next: u32,
    content: u32,
}
var<storage, read> progress: Progress;
var<uniform> trust: f32;
var first_direct: texture_2d<f32>;
var first_indirect: texture_2d<f32>;
var path_direct: texture_2d<f32>;
var path_indirect: texture_2d<f32>;

struct Image {
    @location(0) direct: vec4f,
    @location(1) indirect: vec4f,
    @location(2) color: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Image {
    let pixel = vec2u(position.xy);
    let share = f32(progress.next) / (f32(progress.next) + trust);
    let direct = mix(textureLoad(first_direct, pixel, 0).rgb, textureLoad(path_direct, pixel, 0).rgb, share);
    let indirect = mix(textureLoad(first_indirect, pixel, 0).rgb, textureLoad(path_indirect, pixel, 0).rgb, share);
    return Image(vec4f(direct, 1.0), vec4f(indirect, 1.0), vec4f(direct + indirect, 1.0));
}
