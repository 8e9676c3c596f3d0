//! Light that leaves the scene's lights and emitters in equal parts: each goes one way, and what it meets first is
//! a place from
//! which light comes again. Those that no cell holds light nothing that is asked for.
#import lightgraph::cells::{NO_CELL, key_of}
#import lightgraph::find_cell::find
#import lightgraph::gloss::matte
#import lightgraph::hit::look
#import lightgraph::packed_light
#import lightgraph::photons::{PHOTONS, sum_of}
#import lightgraph::random::{even_pair, scramble, unit}
#import lightgraph::rays::pack_normal
#import lightgraph::sampling
#import lightgraph::trace::{extent, leave}
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#import lightgraph::lights::{Light, arrival, light_count, lights}
#endif
#ifdef EMITTERS
#import lightgraph::emitters::emitters
#endif

/// Three times four words a photon: where it ended and the normal there; the flux that goes on, over pi, what
/// arrives there of all
/// lights, and the cell.
var<storage, read_write> photon_ends: array<vec4u>;

/// Power that is shared out, the sum of the channels.
struct Powers {
    lights: f32,
    emitters: f32,
}

#ifdef LIGHTS
/// Half the rectangle, seen along a direction, that holds the scene.
fn half_across(direction: vec3f) -> vec2f {
    let half = 0.5 * (extent.bounds_max - extent.bounds_min);
    let across = sampling::in_frame(direction, vec3f(1.0, 0.0, 0.0));
    let up = sampling::in_frame(direction, vec3f(0.0, 1.0, 0.0));
    return vec2f(dot(abs(across), half), dot(abs(up), half));
}

/// Solid angle that a light shines into; of a directional one the area.
fn reach(light: Light) -> f32 {
    if light.kind == 2u {
        let half = half_across(light.direction);
        return 4.0 * half.x * half.y;
    }
    return select(12.5663706144, 6.28318530718 * (1.0 - light.cos_outer), light.kind == 1u);
}
#endif

fn powers() -> Powers {
    var p = Powers();
#ifdef LIGHTS
    for (var i = 0u; i < light_count(); i++) {
        p.lights += sum_of(lights[i].intensity) * reach(lights[i]);
    }
#endif
#ifdef EMITTERS
    let e = emitters[0];
    p.emitters = 3.14159265359 * sum_of(e.radiance) * e.area / max(e.cumulative, 1e-20);
#endif
    return p;
}

@compute @workgroup_size(64)
fn photon(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= PHOTONS {
        return;
    }
    let all = powers();
    // Sources take their shares of the photons in turn.
    let chosen = (f32(id.x) + unit(scramble(id.x))) / f32(PHOTONS) * (all.lights + all.emitters);
    let u = even_pair(id.x, 0u);
    var origin = vec3f(0.0);
    var direction = vec3f(0.0, 1.0, 0.0);
    var flux = vec3f(0.0);
#ifdef LIGHTS
    var light = lights[0];
    var share = 0.0;
    if chosen < all.lights {
        var before = 0.0;
        for (var i = 0u; i < light_count(); i++) {
            light = lights[i];
            share = sum_of(light.intensity) * reach(light);
            before += share;
            if chosen < before {
                break;
            }
        }
        if light.kind == 2u {
            let at = (2.0 * u - 1.0) * half_across(light.direction);
            let middle = 0.5 * (extent.bounds_min + extent.bounds_max);
            let back = length(extent.bounds_max - extent.bounds_min);
            direction = light.direction;
            origin = middle + at.x * sampling::in_frame(direction, vec3f(1.0, 0.0, 0.0))
                + at.y * sampling::in_frame(direction, vec3f(0.0, 1.0, 0.0)) - back * direction;
        } else {
            let lowest = select(-1.0, light.cos_outer, light.kind == 1u);
            let cosine = mix(lowest, 1.0, u.x);
            let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
            let axis = select(vec3f(0.0, 1.0, 0.0), light.direction, light.kind == 1u);
            let turn = 6.28318530718 * u.y;
            direction = sampling::in_frame(axis, vec3f(sine * cos(turn), sine * sin(turn), cosine));
            origin = light.position;
        }
    }
#endif
#ifdef EMITTERS
    if chosen >= all.lights {
        let choice = clamp((chosen - all.lights) / all.emitters, 0.0, 0.999999);
        var low = 0u;
        var high = arrayLength(&emitters) - 1u;
        while low < high {
            let middle = (low + high) / 2u;
            if emitters[middle].cumulative <= choice {
                low = middle + 1u;
            } else {
                high = middle;
            }
        }
        let e = emitters[low];
        let at = sampling::triangle(u);
        let normal = normalize(cross(e.b - e.a, e.c - e.a));
        origin = leave(e.a + at.x * (e.b - e.a) + at.y * (e.c - e.a), normal);
        direction = sampling::cosine_direction(normal, even_pair(id.x, 0x9e3779b9u));
        flux = e.radiance / sum_of(e.radiance) * (all.lights + all.emitters) / f32(PHOTONS);
    }
#endif
    let met = look(origin, direction);
    var position = met.surface.position;
    var cell = NO_CELL;
    var arrived = 0.0;
    if met.lit {
        cell = find(key_of(position, met.surface.normal));
    }
    if cell != NO_CELL {
#ifdef LIGHTS
        if chosen < all.lights {
            // As much as the surface takes of the light, over how densely its photons fall.
            let a = arrival(light, position);
            let taken = max(dot(met.surface.normal, a.direction), 0.0) * a.irradiance;
            var density = max(abs(dot(met.flat_normal, direction)), 1e-4) / reach(light);
            if light.kind != 2u {
                density /= max(met.distance * met.distance, 1e-12);
            }
            flux = taken * (all.lights + all.emitters) / (f32(PHOTONS) * share * density);
        }
        arrived = sum_of(irradiance(position, met.surface.normal, met.start));
#endif
    }
    let sent = packed_light::pack(flux * matte(met.surface) / 3.14159265359);
    let normal = select(vec3f(0.0, 1.0, 0.0), met.surface.normal, met.lit);
    photon_ends[3u * id.x] = vec4u(bitcast<vec3u>(position), pack_normal(normal));
    photon_ends[3u * id.x + 1u] = vec4u(sent, bitcast<u32>(arrived), cell);
    photon_ends[3u * id.x + 2u] = vec4u(bitcast<u32>(all.lights + all.emitters), 0u, 0u, 0u);
}
