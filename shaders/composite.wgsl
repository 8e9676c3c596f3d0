//! The image: direct and indirect light together, linear.
var direct: texture_2d<f32>;
var indirect: texture_2d<f32>;

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Image {
    let pixel = vec2u(position.xy);
    return Image(vec4f(textureLoad(direct, pixel, 0).rgb + textureLoad(indirect, pixel, 0).rgb, 1.0));
}
