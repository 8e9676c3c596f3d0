//! One bounce's own share of the image: light from the probes now, less light from the probes a bounce before.
#import lightgraph::camera::pixel_ray
#import lightgraph::surface::{is_lit, read_record}
#import lightgraph::indirect::reflected_probes

var<uniform> behind_seen: f32;
var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
var sh: texture_3d<f32>;
var sh_before: texture_3d<f32>;

struct Image {
    @location(0) bounce_images: vec4f,
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> Image {
    let pixel = vec2u(position.xy);
    let albedo = textureLoad(surface_albedo, pixel, 0);
    if !is_lit(albedo) {
        return Image(vec4f(0.0, 0.0, 0.0, 1.0));
    }
    let ray = pixel_ray(pixel);
    let s = read_record(albedo, textureLoad(surface_normal, pixel, 0), ray.origin, ray.direction);
    let now = reflected_probes(sh, s, behind_seen);
    return Image(vec4f(now - reflected_probes(sh_before, s, behind_seen), 1.0));
}
