//! Path tracing: every batch adds some paths through the centre of each pixel to the mean of those before it.
#import lightgraph::camera::{Ray, pixel_ray}
#import lightgraph::hit::{Met, describe, look}
#import lightgraph::lobe::{reflectance, scatter, scatter_density}
#import lightgraph::means::{Mean, place}
#import lightgraph::random::{scramble, seed, next, next_pair, even_pair}
#import lightgraph::report::{check}
#import lightgraph::rounds::counted
#import lightgraph::trace::{closest_between, FAR}
#ifdef LIGHTS
#import lightgraph::traced_lights::traced_light
#endif
#ifdef EMITTERS
#import lightgraph::emitters
#endif
#ifdef ENVIRONMENT
#import lightgraph::environment
#import lightgraph::environment_light
#endif
#ifdef CLEAR
#import lightgraph::passage::{look_on, through}
#endif
#ifdef UNLIT
#import lightgraph::surface::materials
#endif

struct Params {
    bounces: u32,
    seed: u32,
}
var<uniform> params: Params;

/// Of the paths of all batches that show the same.
var<storage, read_write> path_means: array<Mean>;
var direct: texture_storage_2d<rgba32float, write>;
var indirect: texture_storage_2d<rgba32float, write>;

struct Light {
    direct: vec3f,
    indirect: vec3f,
#ifdef MOMENTS
    /// Square of the sum of the channels of `indirect`.
    square: f32,
#endif
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

/// What leaves a surface that a pixel sees by itself.
fn shown(met: Met) -> vec3f {
#ifdef UNLIT
    if materials[met.material].unlit != 0u {
        return met.glow;
    }
#endif
    return met.surface.emission;
}

#ifdef CLEAR
/// The light along one path from a pixel.
fn path(ray: Ray, index: u32, pixel: vec2u) -> Light {
    var light: Light;
    var carried = vec3f(1.0);
    let shift = seed(pixel, params.seed);
    var state = seed(pixel, scramble(index + scramble(params.seed)));
    var met = look_on(ray.origin, ray.direction, &carried, &state);
#ifdef ENVIRONMENT
    if met.distance >= FAR {
        light.direct = carried * environment::radiance(ray.direction);
    }
#endif
    if !met.lit {
        return light;
    }
    light.direct = carried * shown(met);
#else
/// The light along one path from what a pixel sees; without what leaves that by itself.
fn path(seen: Met, index: u32, pixel: vec2u) -> Light {
    var light: Light;
    var met = seen;
    var carried = vec3f(1.0);
    let shift = seed(pixel, params.seed);
    var state = seed(pixel, scramble(index + scramble(params.seed)));
#endif
    for (var bounce = 0u; bounce <= params.bounces; bounce++) {
        let s = met.surface;
#ifdef UNLIT
        if materials[s.material].unlit != 0u {
            break;
        }
#endif
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
        let direction = scatter(s, v);
        let density = scatter_density(s, direction);
        let reflected = reflectance(s, direction);
        // Below the triangle that a bent normal leans over nothing is: light would meet the surface itself again.
        let above = dot(met.flat_normal, direction) * select(-1.0, 1.0, met.front);
        if density <= 0.0 || above <= 0.0 || all(reflected <= vec3f(0.0)) {
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
#ifdef CLEAR
        met = look_on(met.start, direction, &carried, &state);
#else
        met = look(met.start, direction);
#endif
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
#ifdef EMISSION_MAPS
            let drawn = emitters::density_of(met.emitter, met.distance, -dot(met.flat_normal, direction));
#else
            let drawn = emitters::draw_density(emission, met.distance, -dot(met.flat_normal, direction));
#endif
            add(&light, carried * emission * (density / (density + drawn)), bounce);
        }
#endif
    }
    return light;
}

#ifndef CLEAR
/// Backs of single-sided surfaces that the camera looks through at most.
const BACKS: u32 = 64u;

/// What the camera sees: it looks through the backs of single-sided surfaces, which light does not pass.
fn first_seen(ray: Ray) -> Met {
    var met = look(ray.origin, ray.direction);
    for (var i = 0u; i < BACKS; i++) {
        if met.lit || met.distance >= FAR {
            break;
        }
        // Beyond what was met, by more than its rounding.
        let hit = closest_between(ray.origin, ray.direction, met.distance * 1.00001, FAR);
        met = describe(hit, ray.origin, ray.direction, 0.0);
    }
    return met;
}
#endif

@compute @workgroup_size(8, 8)
fn pathtrace(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    var sum: Light;
    let progress = counted();
    let paths = progress.next - progress.paths;
    if paths == 0u {
        textureStore(direct, id.xy, vec4f(0.0, 0.0, 0.0, 1.0));
        textureStore(indirect, id.xy, vec4f(0.0, 0.0, 0.0, 1.0));
        return;
    }
    let ray = pixel_ray(id.xy);
#ifndef CLEAR
    let seen = first_seen(ray);
    if seen.lit {
#endif
        // One round more than there are paths: a driver that ends the loops of an invocation after so many rounds, as
        // if they were done, leaves it out.
        var rounds = 0u;
        while rounds <= paths {
            if rounds < paths {
#ifdef CLEAR
                let light = path(ray, progress.paths + rounds, id.xy);
#else
                let light = path(seen, progress.paths + rounds, id.xy);
#endif
                sum.direct += light.direct;
                sum.indirect += light.indirect;
#ifdef MOMENTS
                let bright = dot(light.indirect, vec3f(1.0));
                sum.square += bright * bright;
#endif
            }
            rounds++;
        }
        check(rounds > paths, id, #{HERE}); // Else the driver ended the loops: ask for fewer `samples`.
        sum.direct /= f32(paths);
        sum.indirect /= f32(paths);
#ifndef CLEAR
        sum.direct += shown(seen);
    }
#ifdef ENVIRONMENT
    if seen.distance >= FAR {
        sum.direct = environment::radiance(ray.direction);
    }
#endif
#endif
    let share = f32(paths) / f32(progress.next);
    var second = 1.0;
#ifdef MOMENTS
    second = sum.square / f32(paths);
#endif
    // Not even numbers that are none come over from what showed something else.
    var before = Mean();
    if progress.paths > 0u {
        before = path_means[place(id.xy)];
    }
    let direct_mean = mix(before.direct, vec4f(sum.direct, 1.0), share);
    let indirect_mean = mix(before.indirect, vec4f(sum.indirect, second), share);
    path_means[place(id.xy)] = Mean(direct_mean, indirect_mean);
    var alone = false;
#ifdef MOMENTS
#ifdef CLEAR
    // What is gathered there is of what stands behind, or of what is taken for opaque.
    let first = look(ray.origin, ray.direction);
    alone = first.lit && any(through(first) > vec3f(0.0));
#endif
#endif
    textureStore(direct, id.xy, vec4f(direct_mean.rgb, select(1.0, 0.0, alone)));
    textureStore(indirect, id.xy, indirect_mean);
}
