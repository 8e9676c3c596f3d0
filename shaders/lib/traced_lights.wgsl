//! Light straight from the scene's lights, with traced shadows.
#define_import_path lightgraph::traced_lights
#import lightgraph::surface::Surface
#import lightgraph::lights::{lights, arrival, light_count}
#import lightgraph::lobe::reflectance
#ifdef CLEAR
#import lightgraph::passage::free_share
#import lightgraph::trace::FAR
#else
#import lightgraph::trace::{is_free, FAR}
#endif

/// Radiance that a surface reflects towards its viewer straight from all lights. `start`: where its rays start.
fn traced_light(s: Surface, start: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < light_count(); i++) {
        let light = lights[i];
        let a = arrival(light, s.position);
        let reflected = reflectance(s, a.direction) * a.irradiance;
        if any(reflected > vec3f(0.0)) {
            let end = select(distance(light.position, start), FAR, light.kind == 2u);
#ifdef CLEAR
            sum += free_share(start, a.direction, end) * reflected;
#else
            if is_free(start, a.direction, end) {
                sum += reflected;
            }
#endif
        }
    }
    return sum;
}
