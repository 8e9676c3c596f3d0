//! A sketch of the light at each point of the lattice: what a few rays meet, lit straight from the lights.
#ifdef ENVIRONMENT
#import lightgraph::environment
#endif
#import lightgraph::hit::look
#import lightgraph::probe_tree::{Sketch, pack, point_position, points}
#import lightgraph::trace::FAR
#ifdef LIGHTS
#import lightgraph::lights::reflected_light
#endif

var<uniform> sketch_rays: u32;

var<storage, read_write> tree_sketch: array<Sketch>;

/// Direction `i` of `count`: even heights, turned by the golden angle.
fn spiral(i: u32, count: u32) -> vec3f {
    let z = 1.0 - (2.0 * f32(i) + 1.0) / f32(count);
    let angle = 2.39996322973 * f32(i);
    return vec3f(sqrt(1.0 - z * z) * vec2f(cos(angle), sin(angle)), z);
}

@compute @workgroup_size(8, 4, 2)
fn sketch(@builtin(global_invocation_id) id: vec3u) {
    if any(id >= points()) {
        return;
    }
    let point = point_position(id);
    var light = vec4f(0.0);
    var open = 0.0;
    for (var i = 0u; i < sketch_rays; i++) {
        let d = spiral(i, sketch_rays);
        let met = look(point, d);
        open += select(0.0, 1.0, met.lit || met.distance >= FAR);
        var radiance = vec3f(0.0);
#ifdef ENVIRONMENT
        if met.distance >= FAR {
            radiance = environment::mean_radiance(d, 12.5663706144 / f32(sketch_rays));
        }
#endif
        if met.lit {
            radiance = met.surface.emission;
#ifdef LIGHTS
            radiance += reflected_light(met.surface);
#endif
        }
        if any(radiance > vec3f(0.0)) {
            // Y of degree 0, and of degree 1 times 2/3.
            light += dot(radiance, vec3f(1.0 / 3.0)) * vec4f(0.28209479177, 0.32573500793 * d.yzx);
        }
    }
    let share = 1.0 / f32(sketch_rays);
    tree_sketch[pack(id, points())] = Sketch(light * (12.5663706144 * share), open * share);
}
