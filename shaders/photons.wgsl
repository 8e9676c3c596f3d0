//! Light that leaves the scene's lights and emitters in equal parts: each goes one way, and what it meets first is a
//! place from which light comes again. Those that end where no ray did light nothing that is asked for.
#import lightgraph::cells::{NO_CELL, key_of}
#import lightgraph::find_cell::find
#import lightgraph::gloss::{sent_from, sent_on}
#import lightgraph::hit::{flat_side, look}
#import lightgraph::marks::{PARTS, zone_of}
#import lightgraph::packed_light
#ifdef GGX
#import lightgraph::photons::pack_glossy
#endif
#import lightgraph::photons::{PHOTONS, TEXELS, sum_of}
#import lightgraph::random::{even_pair, scramble, unit}
#import lightgraph::rays::pack_normal
#import lightgraph::rounds::frame
#import lightgraph::sampling
#import lightgraph::sent::sent_evenly
#import lightgraph::trace::leave
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#import lightgraph::lights::{arrival, light_count, lights}
#import lightgraph::marks::{first_part, from_beam, last_square, reach}
#import lightgraph::quarters::quarter
#endif
#ifdef EMITTERS
#import lightgraph::emitters::{draw, emitters, radiance_at}
#import lightgraph::random::{next, next_pair}
#import lightgraph::trace::is_free
#endif

/// Rows of four words a photon. Where it ended, and the flat normal there. The flux that goes on, over pi; what
/// arrives there of all lights (and of emitters, where there is no cell); the cell. The power of all, and whether the
/// photon counts. With GGX the flux is what goes on as from a matte surface, and one row more holds the rest.
var<storage, read_write> photon_ends: array<vec4u>;
var<storage, read> marks: array<u32>;
#ifdef LIGHTS
/// See beams.wgsl.
var<storage, read> beams: array<f32>;

/// A place in a light's beam.
struct Way {
    place: vec2f,
    /// How densely photons leave there, over evenly.
    share: f32,
}

/// A place in a light's beam, from a pair of even numbers.
fn way_in_beam(light: u32, pair: vec2f) -> Way {
    var u = pair;
    var at = vec2u(0u);
    var own = beams[first_part(light, 0u)];
    let last = last_square();
    for (var square = 1u; square <= last; square++) {
        at *= 2u;
        let edge = 1u << square;
        let row = first_part(light, square) + at.y * edge + at.x;
        let one = quarter(vec4f(beams[row], beams[row + 1u], beams[row + edge], beams[row + edge + 1u]), u);
        u = one.pair;
        at += one.at;
        own = one.own;
    }
    return Way((vec2f(at) + u) / f32(1u << last), own);
}
#endif

/// Power that is shared out, the sum of the channels.
struct Powers {
    lights: f32,
    emitters: f32,
}

fn powers() -> Powers {
    var p = Powers();
#ifdef LIGHTS
    for (var i = 0u; i < light_count(); i++) {
        p.lights += sum_of(lights[i].intensity) * reach(lights[i]) * beams[first_part(i, 0u)];
    }
#endif
#ifdef EMITTERS
    let e = emitters[0];
    p.emitters = 3.14159265359 * sum_of(e.radiance) / max(e.density, 1e-20);
#endif
    return p;
}

#ifdef EMITTERS
/// Points on emitters that tell about how much comes of them where no cell says so.
const LOOKS: u32 = 8u;

/// About the irradiance over pi from emitters.
fn from_emitters(start: vec3f, normal: vec3f, index: u32) -> vec3f {
    var sum = vec3f(0.0);
    var state = scramble(index);
    for (var i = 0u; i < LOOKS; i++) {
        let p = draw(start, (f32(i) + next(&state)) / f32(LOOKS), next_pair(&state));
        let cosine = dot(normal, p.direction);
        if p.density > 0.0 && cosine > 0.0 && is_free(start, p.direction, p.distance) {
            sum += p.radiance * cosine / (3.14159265359 * p.density);
        }
    }
    return sum / f32(LOOKS);
}
#endif

@compute @workgroup_size(64)
fn photon(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= PHOTONS {
        return;
    }
    let number = frame() * PHOTONS + id.x;
    let all = powers();
    let whole = all.lights + all.emitters;
    // Any run of photons covers all lights and emitters evenly: steps of the golden ratio.
    let chosen = unit(number * 2654435769u) * whole;
    let u = even_pair(number, 0u);
    var origin = vec3f(0.0);
    var direction = vec3f(0.0, 1.0, 0.0);
    var flux = vec3f(0.0);
#ifdef LIGHTS
    var light = lights[0];
    var way = Way();
    if chosen < all.lights {
        var before = 0.0;
        var i = 0u;
        for (; i < light_count(); i++) {
            light = lights[i];
            before += sum_of(light.intensity) * reach(light) * beams[first_part(i, 0u)];
            if chosen < before {
                break;
            }
        }
        way = way_in_beam(min(i, light_count() - 1u), u);
        let beam = from_beam(light, way.place);
        origin = beam.origin;
        direction = beam.direction;
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
        var state = scramble(number ^ 0x9e3779b9u);
        direction = sampling::cosine_direction(normal, next_pair(&state));
        flux = radiance_at(e, at) / sum_of(e.radiance) * whole / f32(PHOTONS);
    }
#endif
    let met = look(origin, direction);
    let position = met.surface.position;
    let normal = select(vec3f(0.0, 1.0, 0.0), met.surface.normal, met.lit);
    let flat_normal = flat_side(met);
    var wanted = false;
    if met.lit && whole > 0.0 {
        let zone = zone_of(position);
        wanted = (marks[PARTS + zone / 32u] >> (zone % 32u) & 1u) != 0u;
    }
    var cell = NO_CELL;
    var arrived = 0.0;
    if wanted {
        cell = find(key_of(position, normal));
#ifdef LIGHTS
        if chosen < all.lights {
            // As much as the surface takes of the light, over how densely its photons fall.
            let a = arrival(light, position);
            let taken = max(dot(normal, a.direction), 0.0) * a.irradiance;
            var density = max(-dot(flat_normal, direction), 1e-4) / reach(light);
            if light.kind != 2u {
                density /= max(met.distance * met.distance, 1e-12);
            }
            flux = taken * whole / (f32(PHOTONS) * sum_of(light.intensity) * reach(light) * way.share * density);
        }
        arrived = sum_of(irradiance(met.surface, met.start).evenly);
#endif
#ifdef EMITTERS
        if chosen >= all.lights {
            // Photons fall as the triangle itself faces their way.
            flux *= max(-dot(normal, direction), 0.0) / max(-dot(flat_normal, direction), 1e-4);
        }
        if cell == NO_CELL {
            arrived += sum_of(from_emitters(met.start, normal, number));
        }
#endif
    }
    flux /= 3.14159265359;
    // Rays tell light of emitters as if it went on evenly.
    var sent = sent_evenly(sent_on(met.surface, -direction));
    if chosen < all.lights {
        sent = sent_from(met.surface, -direction);
    }
    let row = (TEXELS + 1u) * id.x;
    photon_ends[row] = vec4u(bitcast<vec3u>(position), pack_normal(flat_normal));
    photon_ends[row + 1u] = vec4u(packed_light::pack(flux * sent.matte), bitcast<u32>(arrived), cell);
    photon_ends[row + 2u] = vec4u(bitcast<u32>(whole), u32(wanted), 0u, 0u);
#ifdef GGX
    sent.glossy *= flux;
    photon_ends[row + 3u] = pack_glossy(sent);
#endif
}
