//! Light that surfaces receive, from what they send on.
#define_import_path lightgraph::residual
#import lightgraph::surface::Surface

/// Less than this a surface reflects counts as this.
const DARK: f32 = 0.03;

/// The albedo that light is divided by.
fn color_of(s: Surface) -> vec3f {
    return max(s.albedo, vec3f(DARK));
}

fn gray_of(albedo: vec3f) -> f32 {
    return dot(albedo, vec3f(1.0 / 3.0));
}
