//! Indirect light that lobes of surfaces reflect towards the camera, as far as rays along them are likely to find it:
//! what lights the surfaces that they meet, which shine in the scene's lights and count as matte in all other light.
//! Rays that pixels share bring the rest.
#import lightgraph::camera::pixel_ray
#import lightgraph::cells::NO_CELL
#import lightgraph::find_cell::find_near
#import lightgraph::gloss::{as_matte, draw_density, draw_lobe, shines}
#import lightgraph::hit::look_from
#import lightgraph::random::{even_pair, seed}
#import lightgraph::rounds::salt
#import lightgraph::seen::{finished, seen_at}
#import lightgraph::shared_lobes::{by_lobes, lobe_rays}
#import lightgraph::surface::{Surface, is_lit, read_record}
#import lightgraph::trace::leave
#ifdef LIGHTS
#import lightgraph::traced_lights::traced_light
#endif

/// See cell_emission.wgsl and cell_total.wgsl.
var<storage, read> emitted: array<vec4f>;
var<storage, read> held: array<vec4f>;
var lobe_light: texture_storage_2d<rgba32float, write>;

/// Light along a lobe's ray, and in alpha whether it is known.
fn along(s: Surface, direction: vec3f) -> vec4f {
    let met = look_from(leave(s.position, s.normal + s.view), s.position, s.normal, direction);
    if !met.lit {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    let cell = find_near(met.surface.position, met.surface.normal);
    if cell == NO_CELL {
        return vec4f(0.0);
    }
    var light = as_matte(met.surface) * (held[cell].rgb + emitted[cell].rgb);
#ifdef LIGHTS
    light += traced_light(met.surface, met.start);
#endif
    return vec4f(light, 1.0);
}

fn reflected(s: Surface, shift: u32) -> vec3f {
    var sum = vec4f(0.0);
    for (var i = 0u; i < lobe_rays; i++) {
        let direction = draw_lobe(s, even_pair(i, shift));
        if dot(direction, s.normal) <= 0.0 || draw_density(s, direction) <= 0.0 {
            sum.a += 1.0;
            continue;
        }
        let light = along(s, direction);
        sum += vec4f(by_lobes(s, direction) * light.rgb, light.a);
    }
    return max(sum.rgb / max(sum.a, 1.0), vec3f(0.0));
}

@compute @workgroup_size(8, 8)
fn find_lobe_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(lobe_light)) {
        return;
    }
    var light = vec3f(0.0);
    let seen = seen_at(id.xy);
    if is_lit(seen.albedo) {
        let ray = pixel_ray(id.xy);
        let s = finished(read_record(seen.albedo, seen.normal, ray.origin, ray.direction), id.xy);
        if shines(s) {
            light = reflected(s, seed(id.xy, 6u + salt()));
        }
    }
    textureStore(lobe_light, id.xy, vec4f(light, 1.0));
}
