//! Irradiance from the scene's lights, over pi, with traced shadows: what a white matte surface reflects of them.
#define_import_path lightgraph::irradiance
#import lightgraph::lights::{lights, arrival, light_count}
#import lightgraph::trace::{is_free, FAR}

/// At a point with a unit normal; `start`: where its rays start.
fn irradiance(point: vec3f, normal: vec3f, start: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < light_count(); i++) {
        let light = lights[i];
        let a = arrival(light, point);
        let arriving = max(dot(a.direction, normal), 0.0) / 3.14159265359 * a.irradiance;
        if any(arriving > vec3f(0.0)) {
            let end = select(distance(light.position, start), FAR, light.kind == 2u);
            if is_free(start, a.direction, end) {
                sum += arriving;
            }
        }
    }
    return sum;
}
