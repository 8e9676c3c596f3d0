//! Light that surfaces reflect straight from the environment, with traced shadows.
#define_import_path lightgraph::environment_light
#import lightgraph::environment::{Drawn, draw, draw_density, radiance}
#import lightgraph::lobe::{reflectance, scatter, scatter_density}
#import lightgraph::random::{sobol_pair, scramble}
#import lightgraph::surface::Surface
#import lightgraph::trace::{is_free, FAR}
#ifdef SHARED_RAYS
#import lightgraph::gloss::matte
#import lightgraph::sky_guide::{drawn_density, draws, guided}
#ifdef SPECULAR
#import lightgraph::gloss::{draw_density as draw_lobe_density, draw_lobe, glossy}
#endif
#endif
#ifdef CLEAR
#import lightgraph::passage::free_share
#endif

/// An estimate of it from one direction drawn by its light, weighed against one drawn by `lobe::scatter` with the
/// density that `scattered` gives for it (balance heuristic of Veach, 1995).
fn estimate(s: Surface, start: vec3f, d: Drawn, scattered: f32) -> vec3f {
    let light = reflectance(s, d.direction) * d.radiance;
#ifdef CLEAR
    if d.density <= 0.0 || all(light <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    return free_share(start, d.direction, FAR) * light / (d.density + scattered);
#else
    if d.density <= 0.0 || all(light <= vec3f(0.0)) || !is_free(start, d.direction, FAR) {
        return vec3f(0.0);
    }
    return light / (d.density + scattered);
#endif
}

/// The light that a scattered direction of this density brings, over the radiance: the other half of `estimate`.
fn arrived(direction: vec3f, density: f32) -> vec3f {
    return radiance(direction) * (density / (density + draw_density(direction)));
}

#ifdef SHARED_RAYS
/// Part of what a surface without lobes reflects of the environment, from directions drawn by its light and by where a
/// block of points sees it. SHARED_RAYS directions drawn by the cosine bring the other part elsewhere: all are weighed
/// against each other.
fn drawn_environment(s: Surface, start: vec3f, samples: u32, shift: u32, block: u32) -> vec3f {
    var sum = vec3f(0.0);
    let count = draws(block, samples);
    for (var i = 0u; i < count.x + count.y; i++) {
        let pair = sobol_pair(i, scramble(shift));
        var d = Drawn();
        if i < count.y {
            d.direction = guided(block, pair);
            d.radiance = radiance(d.direction);
            d.density = draw_density(d.direction);
        } else {
            d = draw(pair);
        }
        let density = max(dot(s.normal, d.direction), 0.0) / 3.14159265359;
        if density > 0.0 && any(d.radiance > vec3f(0.0)) && is_free(start, d.direction, FAR) {
            let drawn = drawn_density(block, samples, d.direction, d.density);
            sum += density * d.radiance / (drawn + f32(#{SHARED_RAYS}) * density);
        }
    }
    return matte(s) * sum;
}

#ifdef SPECULAR
/// All that the lobes of a surface reflect of the environment: half of the directions are drawn by the lobes.
fn mirrored_environment(s: Surface, start: vec3f, samples: u32, shift: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < samples; i++) {
        let d = draw(sobol_pair(i, scramble(shift)));
        let reflected = glossy(s, d.direction);
        let light = reflected * d.radiance / (d.density + draw_lobe_density(s, d.direction));
        if d.density > 0.0 && any(light > vec3f(0.0)) && is_free(start, d.direction, FAR) {
            sum += light;
        }
        let direction = draw_lobe(s, sobol_pair(i, shift));
        let density = draw_lobe_density(s, direction);
        if density > 0.0 && dot(s.normal, direction) > 0.0 && is_free(start, direction, FAR) {
            sum += glossy(s, direction) / density * arrived(direction, density);
        }
    }
    return sum / f32(samples);
}
#endif
#endif

/// Radiance that a surface reflects towards its viewer straight from the environment: the mean over `samples`
/// directions drawn by its light, and as many drawn by what the surface reflects. `start`: where its rays start;
/// `shift` moves the directions.
fn reflected_environment(s: Surface, start: vec3f, samples: u32, shift: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < samples; i++) {
        let d = draw(sobol_pair(i, scramble(shift)));
        sum += estimate(s, start, d, scatter_density(s, d.direction));
        let direction = scatter(s, sobol_pair(i, shift));
        let density = scatter_density(s, direction);
        let reflected = reflectance(s, direction);
        if density > 0.0 && any(reflected > vec3f(0.0)) && is_free(start, direction, FAR) {
            sum += reflected / density * arrived(direction, density);
        }
    }
    return sum / f32(samples);
}
