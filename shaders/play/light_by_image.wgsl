//! Surfaces in the light of an image of all around, and the image behind them. Nothing shades them.
#import lightgraph::camera::pixel_ray
#import lightgraph::surface::{is_lit, is_nothing, read_record}
#import lightgraph::metallic_roughness
#ifdef UNLIT
#import lightgraph::surface::unlit_of
#endif

var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;
var glossy: texture_cube<f32>;
var matte: texture_cube<f32>;
var linear: sampler;

/// What a lobe reflects of even light head on and towards grazing angles, for a roughness and a cosine to the viewer
/// (Lazarov, "Getting More Physical in Call of Duty: Black Ops II", 2013, as Karis fitted it for mobiles).
fn reflected(roughness: f32, cosine: f32) -> vec2f {
    let r = roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let edge = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
    return vec2f(-1.04, 1.04) * edge + r.zw;
}

struct Image {
    @location(0) color: vec4f,
}

@fragment
fn light(@builtin(position) at: vec4f) -> Image {
    let pixel = vec2u(at.xy);
    let albedo = textureLoad(surface_albedo, pixel, 0);
    let normal = textureLoad(surface_normal, pixel, 0);
    let ray = pixel_ray(pixel);
    if is_nothing(albedo, normal) {
        return Image(vec4f(textureSampleLevel(glossy, linear, ray.direction, 0.0).rgb, 1.0));
    }
    if !is_lit(albedo) {
        return Image(vec4f(0.0, 0.0, 0.0, 1.0));
    }
    let s = read_record(albedo, normal, ray.origin, ray.direction);
    let levels = f32(textureNumLevels(glossy) - 1u);
    let cosine = clamp(dot(s.normal, s.view), 0.0, 1.0);
    let mirrored = reflect(-s.view, s.normal);
    let tints = metallic_roughness::tints(s);
    let share = reflected(s.roughness, cosine);
    let gloss = tints[0] * share.x + (tints[0] + tints[1]) * share.y;
    var color = s.emission + metallic_roughness::matte(s) * textureSampleLevel(matte, linear, s.normal, 0.0).rgb;
    color += gloss * textureSampleLevel(glossy, linear, mirrored, s.roughness * levels).rgb;
#ifdef UNLIT
    color += unlit_of(albedo);
#endif
    return Image(vec4f(color, 1.0));
}
