//! Light from the scene's lights that goes on from surfaces, with traced shadows.
#define_import_path lightgraph::irradiance
#import lightgraph::lights::{lights, arrival, light_count}
#import lightgraph::surface::Surface
#import lightgraph::trace::{is_free, FAR}
#ifdef GGX
#import lightgraph::gloss::{mean_albedo, sent_from}
#import lightgraph::sent::towards
#endif

/// Irradiance over pi, so that its product with `gloss::mean_albedo` goes on.
struct Irradiance {
    /// In all directions, on the mean. Lobes send on more or less of a light than of light from all around: each light
    /// counts as much more or less.
    evenly: vec3f,
    /// Towards the viewer.
    seen: vec3f,
}

/// `start`: where the surface's rays start.
fn irradiance(s: Surface, start: vec3f) -> Irradiance {
    var sum = Irradiance();
    for (var i = 0u; i < light_count(); i++) {
        let light = lights[i];
        let a = arrival(light, s.position);
        let arriving = max(dot(a.direction, s.normal), 0.0) / 3.14159265359 * a.irradiance;
        if any(arriving > vec3f(0.0)) {
            let end = select(distance(light.position, start), FAR, light.kind == 2u);
            if is_free(start, a.direction, end) {
#ifdef GGX
                let over = arriving / max(mean_albedo(s), vec3f(1e-6));
                let sent = sent_from(s, a.direction);
                sum.evenly += over * (sent.matte + sent.glossy);
                sum.seen += over * towards(sent, s.view);
#else
                sum.evenly += arriving;
                sum.seen += arriving;
#endif
            }
        }
    }
    return sum;
}
