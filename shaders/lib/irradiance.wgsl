//! Light from the scene's lights that goes on from surfaces, with traced shadows.
#define_import_path lightgraph::irradiance
#import lightgraph::lights::{lights, arrival, light_count}
#import lightgraph::surface::Surface
#import lightgraph::trace::{is_free, FAR}
#ifdef GGX
#import lightgraph::gloss::{mean_albedo, sent_on}
#endif

/// Irradiance over pi, so that its product with `gloss::mean_albedo` goes on. Lobes send on more or less of a light
/// than of light from all around: each light counts as much more or less. `start`: where its rays start.
fn irradiance(s: Surface, start: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < light_count(); i++) {
        let light = lights[i];
        let a = arrival(light, s.position);
        let arriving = max(dot(a.direction, s.normal), 0.0) / 3.14159265359 * a.irradiance;
        if any(arriving > vec3f(0.0)) {
            let end = select(distance(light.position, start), FAR, light.kind == 2u);
            if is_free(start, a.direction, end) {
#ifdef GGX
                sum += arriving * sent_on(s, a.direction) / max(mean_albedo(s), vec3f(1e-6));
#else
                sum += arriving;
#endif
            }
        }
    }
    return sum;
}
