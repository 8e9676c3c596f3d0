//! Light straight from emissive triangles, with traced shadows.
#define_import_path lightgraph::emitters
#import lightgraph::surface::Surface
#import lightgraph::lobe::reflectance
#import lightgraph::gloss::{lobes, matte, tints}
#import lightgraph::random::{even_pair, scramble, unit}
#import lightgraph::sampling
#import lightgraph::trace::is_free
#ifdef CLEAR
#import lightgraph::passage::free_share
#endif
#ifdef EMISSION_MAPS
#import lightgraph::textures
#endif

struct Emitter {
    a: vec3f,
    area: f32,
    b: vec3f,
    /// Share of the power up to and with this row.
    cumulative: f32,
    c: vec3f,
    /// Of picking a point on it by power, per m².
    density: f32,
    /// Leaves the front, on average.
    radiance: vec3f,
#ifdef EMISSION_MAPS
    /// Row of `textures`, 0xffffffff for none, with coordinates at the corners; what it multiplies.
    texture: u32,
    uva: vec2f,
    uvb: vec2f,
    uvc: vec2f,
    emission: vec3f,
#endif
}
var<storage, read> emitters: array<Emitter>;

/// Rays end this share before an emitter, which would be in its own way.
const REACH: f32 = 0.9999;

/// Light from a point on an emitter.
struct Sample {
    /// Unit, towards the point.
    direction: vec3f,
    /// Metres.
    distance: f32,
    radiance: vec3f,
    /// Of drawing the direction, in 1/sr; 0 where no light comes from it.
    density: f32,
}

/// A point on an emitter chosen by power: `choice` chooses the triangle, `u` the point on it.
fn draw(origin: vec3f, choice: f32, u: vec2f) -> Sample {
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
    return towards(emitters[low], origin, u);
}

/// A point on one emitter, `u` of the unit square, as seen from a point.
fn towards(e: Emitter, origin: vec3f, u: vec2f) -> Sample {
    let at = sampling::triangle(u);
    let offset = e.a + at.x * (e.b - e.a) + at.y * (e.c - e.a) - origin;
    let distance = max(length(offset), 1e-15);
    let direction = offset / distance;
    let cosine = -dot(normalize(cross(e.b - e.a, e.c - e.a)), direction);
    let density = e.density * distance * distance / max(cosine, 1e-6);
    var radiance = e.radiance;
#ifdef EMISSION_MAPS
    if e.texture != textures::NONE {
        let uv = e.uva + at.x * (e.uvb - e.uva) + at.y * (e.uvc - e.uva);
        radiance = e.emission * textures::filtered(e.texture, uv, mat2x2f()).rgb;
    }
#endif
    return Sample(direction, distance, radiance, select(0.0, density, cosine > 0.0));
}

#ifdef EMISSION_MAPS
/// The density, in 1/sr, with which `draw` would have met a point of an emitter, a row or 0xffffffff for none, `distance` away, that is
/// seen under `cosine` to its front.
fn density_of(row: u32, distance: f32, cosine: f32) -> f32 {
    if row == 0xffffffffu {
        return 0.0;
    }
    return emitters[row].density * distance * distance / max(cosine, 1e-6);
}
#endif

/// The density, in 1/sr, with which `draw` would have met a point of emission `radiance`, `distance` away, that is
/// seen under `cosine` to its front.
fn draw_density(radiance: vec3f, distance: f32, cosine: f32) -> f32 {
    let first = emitters[0];
    let share = dot(radiance, vec3f(1.0)) / dot(first.radiance, vec3f(1.0));
    return first.density * share * distance * distance / max(cosine, 1e-6);
}

/// Irradiance over radiance of an unshadowed triangle of constant radiance, by Lambert's sum over the edges (Baum,
/// Rushmeier, Winget, "Improving Radiosity Solutions Through the Use of Analytically Determined Form Factors",
/// 1989). What lies
/// behind the surface is cut off.
fn form(e: Emitter, point: vec3f, normal: vec3f) -> f32 {
    let corners = array<vec3f, 3>(e.a - point, e.b - point, e.c - point);
    var cut: array<vec3f, 4>;
    var count = 0u;
    for (var i = 0u; i < 3u; i++) {
        let p = corners[i];
        let q = corners[(i + 1u) % 3u];
        let heights = vec2f(dot(p, normal), dot(q, normal));
        if heights.x > 0.0 {
            cut[count] = p;
            count++;
        }
        if (heights.x > 0.0) != (heights.y > 0.0) {
            cut[count] = p + (q - p) * (heights.x / (heights.x - heights.y));
            count++;
        }
    }
    var sum = 0.0;
    for (var i = 0u; i < count; i++) {
        let p = normalize(cut[i]);
        let q = normalize(cut[select(i + 1u, 0u, i + 1u == count)]);
        let across = cross(p, q);
        let sine = length(across);
        if sine > 1e-9 {
            sum += atan2(sine, dot(p, q)) * dot(across, normal) / sine;
        }
    }
    return 0.5 * abs(sum);
}

/// Radiance that a surface reflects towards its viewer straight from all emitters. `start`: where its rays start.
///
/// Lambert: the exact irradiance of each triangle, times the share of it that `samples` points evenly spread over
/// the triangle see; exact where all or none of them do. Phong: the mean over the points. `shift` moves the points.
fn reflected_emitters(s: Surface, start: vec3f, samples: u32, shift: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < arrayLength(&emitters); i++) {
        let e = emitters[i];
        let flat_normal = cross(e.b - e.a, e.c - e.a);
        if dot(flat_normal, start - e.a) <= 0.0 {
            continue;
        }
        let whole = form(e, start, s.normal);
        if whole <= 0.0 {
            continue;
        }
        // Of the points' irradiance: all, and what arrives; the gloss that arrives.
        var all = 0.0;
#ifdef EMISSION_MAPS
        // Times the radiance of each point.
        var arrived = vec3f(0.0);
#else
        var arrived = 0.0;
#endif
        var shine = vec3f(0.0);
        for (var k = 0u; k < samples; k++) {
            let p = towards(e, start, even_pair(k, shift + i));
            let cosine = dot(s.normal, p.direction);
            if cosine <= 0.0 || p.density <= 0.0 {
                continue;
            }
            // The emitter's density is the power's: a weight without it is the solid angle of a point's share.
            let angle = e.density * e.area / (p.density * f32(samples));
            all += cosine * angle;
            if is_free(start, p.direction, REACH * p.distance) {
#ifdef EMISSION_MAPS
                arrived += cosine * angle * p.radiance;
#ifdef SPECULAR
                sum += p.radiance * (tints(s) * lobes(s, p.direction)) * angle;
#endif
#else
                arrived += cosine * angle;
#ifdef SPECULAR
                shine += lobes(s, p.direction) * angle;
#endif
#endif
            }
        }
#ifdef EMISSION_MAPS
        if all > 0.0 {
            sum += matte(s) / 3.14159265359 * whole * (arrived / all);
        }
#else
        if all > 0.0 {
            sum += e.radiance * (matte(s) / 3.14159265359 * whole * (arrived / all) + tints(s) * shine);
        }
#endif
    }
    return sum;
}

/// The same with about `samples` points in all, most on the triangles that would give most without shadows; those
/// that would give
/// less than a point's share are left to chance. Where the `first` points on a triangle see all of it, or none, no
/// others are asked.
fn chosen_emitters(s: Surface, start: vec3f, samples: u32, first: u32, shift: u32) -> vec3f {
    let count = arrayLength(&emitters);
    var total = 0.0;
    for (var i = 0u; i < count; i++) {
        total += unshadowed(emitters[i], s, start);
    }
    if total <= 0.0 {
        return vec3f(0.0);
    }
    var sum = vec3f(0.0);
    for (var i = 0u; i < count; i++) {
        let e = emitters[i];
        let expected = unshadowed(e, s, start) * f32(samples) / total;
        if expected <= 0.0 || expected < unit(scramble(shift + i)) {
            continue;
        }
        let points = u32(ceil(expected));
        var all = 0.0;
        var arrived = 0.0;
        var shine = vec3f(0.0);
        var asked = 0u;
        while asked < points {
            if asked == first && (arrived == 0.0 || arrived == all) {
                break;
            }
            let p = towards(e, start, even_pair(asked, shift + i));
            asked++;
            let cosine = dot(s.normal, p.direction);
            if cosine <= 0.0 || p.density <= 0.0 {
                continue;
            }
            let angle = e.density * e.area / p.density;
            all += cosine * angle;
            if is_free(start, p.direction, REACH * p.distance) {
                arrived += cosine * angle;
#ifdef SPECULAR
                shine += lobes(s, p.direction) * angle;
#endif
            }
        }
        if all > 0.0 {
            let whole = form(e, start, s.normal) / min(expected, 1.0);
            sum += e.radiance * (matte(s) / 3.14159265359 * whole * (arrived / all) + tints(s) * shine / f32(asked));
        }
    }
    return sum;
}

/// Times the area that the square of an emitter's distance is, from which on it is small.
const LARGE: f32 = 8.0;

/// About what an emitter would give a surface without shadows, the sum of the channels: more than nothing wherever
/// it gives some.
fn unshadowed(e: Emitter, s: Surface, start: vec3f) -> f32 {
    let offset = (e.a + e.b + e.c) / 3.0 - start;
    let across = cross(e.b - e.a, e.c - e.a);
    let reach = max(max(dot(e.a - start, s.normal), dot(e.b - start, s.normal)), dot(e.c - start, s.normal));
    if dot(across, start - e.a) <= 0.0 || reach <= 0.0 {
        return 0.0;
    }
    let square = dot(offset, offset);
    // Of one that is large from here the middle says little.
    if LARGE * e.area > square {
        return form(e, start, s.normal) * dot(e.radiance, vec3f(1.0));
    }
    let way = offset * inverseSqrt(max(square, 1e-20));
    let cosines = max(dot(s.normal, way), 0.05) * max(-dot(normalize(across), way), 0.05);
    return cosines * e.area / (square + e.area) * dot(e.radiance, vec3f(1.0));
}

/// An estimate of the same from one point chosen by power, weighed against a direction drawn by `lobe::scatter` with
/// the density that `scattered` gives for it (balance heuristic of Veach, 1995).
fn estimate(s: Surface, start: vec3f, p: Sample, scattered: f32) -> vec3f {
    let light = reflectance(s, p.direction) * p.radiance;
#ifdef CLEAR
    if p.density <= 0.0 || all(light <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    return free_share(start, p.direction, REACH * p.distance) * light / (p.density + scattered);
#else
    if p.density <= 0.0 || all(light <= vec3f(0.0)) || !is_free(start, p.direction, REACH * p.distance) {
        return vec3f(0.0);
    }
    return light / (p.density + scattered);
#endif
}
