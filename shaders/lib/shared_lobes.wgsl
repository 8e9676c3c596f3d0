//! How rays along the lobes of a surface and the rays that pixels share divide light which both may find: by how
//! likely each finds it (the balance heuristic).
#define_import_path lightgraph::shared_lobes
#import lightgraph::gloss::{draw_density, glossy}
#import lightgraph::surface::Surface

/// Rays along the lobes, of a pixel.
var<uniform> lobe_rays: u32;

/// What the lobes reflect of light from a direction above the surface, over the density of both kinds of rays there.
fn reflected(s: Surface, direction: vec3f) -> vec3f {
    let shared_rays = f32(#{SHARED_RAYS}) * dot(s.normal, direction) / 3.14159265359;
    let all = shared_rays + f32(lobe_rays) * draw_density(s, direction);
    return glossy(s, direction) / max(all, 1e-20);
}

/// What the lobes reflect of light that a shared ray brings, over what a white matte surface reflects of it.
fn by_shared(s: Surface, direction: vec3f) -> vec3f {
    if dot(s.normal, direction) <= 0.0 {
        return vec3f(0.0);
    }
    return f32(#{SHARED_RAYS}) * reflected(s, direction);
}

/// What the lobes reflect of light along a ray drawn from them, above the surface.
fn by_lobes(s: Surface, direction: vec3f) -> vec3f {
    return f32(lobe_rays) * reflected(s, direction);
}
