//! Path tracing: every batch adds some paths through the centre of each pixel to the mean of those before it.
#import lightgraph::camera::pixel_ray
#import lightgraph::hit::{Met, look}
#import lightgraph::lobe::{reflectance, scatter, scatter_density}
#import lightgraph::random::{scramble, seed, next, next_pair, even_pair}
#import lightgraph::report::{check}
#ifdef LIGHTS
#import lightgraph::traced_lights::traced_light
#endif
#ifdef EMITTERS
#import lightgraph::emitters
#endif
#ifdef ENVIRONMENT
#import lightgraph::environment
#import lightgraph::environment_light
#import lightgraph::trace::FAR
#endif

struct Params {
    bounces: u32,
    seed: u32,
}
var<uniform> params: Params;

struct Progress {
    /// Before this batch, and with it.
    paths: u32,
    next: u32,
    content: u32,
}
var<storage, read> progress: Progress;
var direct_before: texture_2d<f32>;
var indirect_before: texture_2d<f32>;
var direct: texture_storage_2d<rgba32float, write>;
var indirect: texture_storage_2d<rgba32float, write>;

struct Light {
    direct: vec3f,
    indirect: vec3f,
}

fn add(light: ptr<function, Light>, amount: vec3f, bounce: u32) {
    if bounce == 0u {
        (*light).direct += amount;
    } else {
        (*light).indirect += amount;
    }
}

/// Bounces after which a path may end by chance, as likely as it carries little light.
const SURE: u32 = 3u;

/// The light along one path from what a pixel sees; without the emission of that.
fn path(seen: Met, index: u32, pixel: vec2u) -> Light {
    var light: Light;
    var met = seen;
    var carried = vec3f(1.0);
    let shift = seed(pixel, params.seed);
    var state = seed(pixel, scramble(index + scramble(params.seed)));
    for (var bounce = 0u; bounce <= params.bounces; bounce++) {
        let s = met.surface;
#ifdef LIGHTS
        add(&light, carried * traced_light(s, met.start), bounce);
#endif
#ifdef EMITTERS
        var u = next_pair(&state);
        if bounce == 0u {
            u = even_pair(index, scramble(shift));
        }
        let p = emitters::draw(met.start, next(&state), u);
        add(&light, carried * emitters::estimate(s, met.start, p, scatter_density(s, p.direction)), bounce);
#endif
#ifdef ENVIRONMENT
        var w = next_pair(&state);
        if bounce == 0u {
            w = even_pair(index, scramble(scramble(shift)));
        }
        let d = environment::draw(w);
        add(&light, carried * environment_light::estimate(s, met.start, d, scatter_density(s, d.direction)), bounce);
#endif
#ifndef LAST_RAY
        if bounce == params.bounces {
            break;
        }
#endif
        var v = next_pair(&state);
        if bounce == 0u {
            v = even_pair(index, shift);
        }
        let direction = scatter(s, next(&state), v);
        let density = scatter_density(s, direction);
        let reflected = reflectance(s, direction);
        if density <= 0.0 || all(reflected <= vec3f(0.0)) {
            break;
        }
        carried *= reflected / density;
        if bounce >= SURE {
            let survival = clamp(max(max(carried.r, carried.g), carried.b), 0.05, 1.0);
            if next(&state) >= survival {
                break;
            }
            carried /= survival;
        }
        met = look(met.start, direction);
#ifdef ENVIRONMENT
        if met.distance >= FAR {
            add(&light, carried * environment_light::arrived(direction, density), bounce);
        }
#endif
        if !met.lit {
            break;
        }
#ifdef EMITTERS
        let emission = met.surface.emission;
        if any(emission > vec3f(0.0)) {
            let drawn = emitters::draw_density(emission, met.distance, -dot(met.flat_normal, direction));
            add(&light, carried * emission * (density / (density + drawn)), bounce);
        }
#endif
    }
    return light;
}

@compute @workgroup_size(8, 8)
fn pathtrace(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    var sum: Light;
    let ray = pixel_ray(id.xy);
    let seen = look(ray.origin, ray.direction);
    let paths = progress.next - progress.paths;
    if seen.lit {
        // One round more than there are paths: a driver that ends the loops of an invocation after so many rounds, as if they
        // were done, leaves it out.
        var rounds = 0u;
        while rounds <= paths {
            if rounds < paths {
                let light = path(seen, progress.paths + rounds, id.xy);
                sum.direct += light.direct;
                sum.indirect += light.indirect;
            }
            rounds++;
        }
        check(rounds > paths, id, #{HERE});
        sum.direct = sum.direct / f32(paths) + seen.surface.emission;
        sum.indirect /= f32(paths);
    }
#ifdef ENVIRONMENT
    if seen.distance >= FAR {
        sum.direct = environment::radiance(ray.direction);
    }
#endif
    let share = f32(paths) / f32(progress.next);
    let direct_mean = mix(textureLoad(direct_before, id.xy, 0).rgb, sum.direct, share);
    let indirect_mean = mix(textureLoad(indirect_before, id.xy, 0).rgb, sum.indirect, share);
    textureStore(direct, id.xy, vec4f(direct_mean, 1.0));
    textureStore(indirect, id.xy, vec4f(indirect_mean, 1.0));
}
