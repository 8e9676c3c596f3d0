//! The first value.
var<storage, read> values: array<f32>;

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Image {
    return Image(vec4f(values[0]));
}
