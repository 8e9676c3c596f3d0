//! Light straight from emissive triangles, with traced shadows.
#define_import_path lightgraph::emitters
#import lightgraph::surface::Surface
#import lightgraph::lobe::reflectance
#import lightgraph::gloss::matte
#ifdef SPECULAR
#import lightgraph::gloss::{draw_lobe, glossy, shines, taken}
#import lightgraph::gloss
#import lightgraph::surface::materials
#import lightgraph::trace
#endif
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
    return towards(emitters[row_of(choice, 0u, arrayLength(&emitters) - 1u)], origin, u);
}

/// The row, from the first to the last of some, up to which this share of the power is reached.
fn row_of(choice: f32, first: u32, last: u32) -> u32 {
    var low = first;
    var high = last;
    while low < high {
        let middle = (low + high) / 2u;
        if emitters[middle].cumulative <= choice {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

/// A point on one emitter, `u` of the unit square, as seen from a point.
fn towards(e: Emitter, origin: vec3f, u: vec2f) -> Sample {
    let at = sampling::triangle(u);
    let offset = e.a + at.x * (e.b - e.a) + at.y * (e.c - e.a) - origin;
    let distance = max(length(offset), 1e-15);
    let direction = offset / distance;
    let cosine = -dot(normalize(cross(e.b - e.a, e.c - e.a)), direction);
    let density = e.density * distance * distance / max(cosine, 1e-6);
    return Sample(direction, distance, radiance_at(e, at), select(0.0, density, cosine > 0.0));
}

/// Leaves the front of an emitter at a point, by its weights of the second corner and the third.
fn radiance_at(e: Emitter, at: vec2f) -> vec3f {
#ifdef EMISSION_MAPS
    if e.texture != textures::NONE {
        let uv = e.uva + at.x * (e.uvb - e.uva) + at.y * (e.uvc - e.uva);
        return e.emission * textures::filtered(e.texture, uv, mat2x2f()).rgb;
    }
#endif
    return e.radiance;
}

#ifdef EMISSION_MAPS
/// The density, in 1/sr, with which `draw` would have met a point of an emitter, a row or 0xffffffff for none,
/// `distance` away, that is seen under `cosine` to its front.
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
/// Rushmeier, Winget, "Improving Radiosity Solutions Through the Use of Analytically Determined Form Factors", 1989).
/// What lies behind the surface is cut off.
fn form(e: Emitter, point: vec3f, normal: vec3f) -> f32 {
    let a = e.a - point;
    let b = e.b - point;
    let c = e.c - point;
    let heights = vec3f(dot(a, normal), dot(b, normal), dot(c, normal));
    let above = heights > vec3f(0.0);
    // Where the edges pass the horizon. No arrays: drivers keep those in memory.
    let ab = a + (b - a) * (heights.x / (heights.x - heights.y));
    let bc = b + (c - b) * (heights.y / (heights.y - heights.z));
    let ca = c + (a - c) * (heights.z / (heights.z - heights.x));
    let passes = above != above.yzx;
    var sum = select(0.0, arc(select(ab, a, above.x), select(ab, b, above.y), normal), above.x || above.y);
    sum += select(0.0, arc(select(bc, b, above.y), select(bc, c, above.z), normal), above.y || above.z);
    sum += select(0.0, arc(select(ca, c, above.z), select(ca, a, above.x), normal), above.z || above.x);
    // Along the horizon, from the edge that goes down to the one that comes up.
    let down = select(select(ca, bc, passes.y && above.y), ab, passes.x && above.x);
    let up = select(select(ca, bc, passes.y && above.z), ab, passes.x && above.y);
    sum += select(0.0, arc(down, up, normal), any(passes));
    return 0.5 * abs(sum);
}

/// The angle from one direction to another, times the cosine of their plane's normal to `normal`. Of any lengths.
fn arc(p: vec3f, q: vec3f, normal: vec3f) -> f32 {
    let across = cross(p, q);
    let sine = length(across);
    return select(0.0, atan2(sine, dot(p, q)) * dot(across, normal) / sine, sine > 0.0);
}

/// Pixels that are shaded at once, across and down.
const BLOCK: vec2u = vec2u(8u, 4u);

/// Times as many points at most where many triangles give alike.
const MANY: u32 = 8u;

/// Points for each of the triangles that give alike.
const POINTS: f32 = 4.0;

/// Points on a triangle that tell whether a surface sees all or none of it, mostly.
const FIRST_POINTS: u32 = 8u;
/// Where they agree, one block of surfaces in so many asks the others, too, and counts what these change so many times:
/// so the mean is right behind a grate, through which few points are seen.
const ONE_IN: u32 = 4u;

/// Triangles that a surface looks at, at most.
const LOOKED_AT: u32 = 512u;

/// A triangle that is looked at, and how many times its light stands for that of its neighbours.
struct Looked {
    row: u32,
    stands_for: f32,
}

/// The `i`th of `count` triangles that are looked at: all, or one of each stretch of the table, chosen by power.
fn looked_at(i: u32, count: u32, shift: u32) -> Looked {
    let rows = arrayLength(&emitters);
    if count == rows {
        return Looked(i, 1.0);
    }
    let first = u32(f32(i) / f32(count) * f32(rows));
    let next = select(u32(f32(i + 1u) / f32(count) * f32(rows)), rows, i + 1u == count);
    let before = select(emitters[max(first, 1u) - 1u].cumulative, 0.0, first == 0u);
    let power = emitters[next - 1u].cumulative - before;
    let row = row_of(before + unit(scramble(shift + i)) * power, first, next - 1u);
    return Looked(row, power / max(emitters[row].density * emitters[row].area, 1e-20));
}

/// Radiance that a surface reflects towards its viewer straight from all emitters. `start`: where its rays start.
///
/// `samples` points, from the first to the second number of them, the more the more triangles give alike: each has
/// shadows of its own. As many to a triangle as its share of what all would give without shadows, drawn at even
/// distances along the sum of these shares, from `first` of a distance on. Matte: the exact irradiance of a triangle,
/// times the share of its points that is seen; so what sees all emitters, or none, has no noise. Lobes: the mean over
/// the points, and half as many directions drawn from the lobes, each weighed against the other (balance heuristic of
/// Veach, 1995). Where the first points on a triangle see all of it, or none, others are asked seldom. Of more than
/// LOOKED_AT triangles some stand for all. `shift` moves the points, and chooses these; `block` is the same for
/// surfaces that a device shades at once, which wait for each other.
fn reflected_emitters(s: Surface, start: vec3f, samples: vec2u, first: f32, shift: u32, block: u32) -> vec3f {
    let count = min(arrayLength(&emitters), LOOKED_AT);
    var total = 0.0;
    var roots = 0.0;
    for (var i = 0u; i < count; i++) {
        let looked = looked_at(i, count, shift);
        let alone = looked.stands_for * unshadowed(emitters[looked.row], s, start);
        total += alone;
        roots += sqrt(alone);
    }
    if total <= 0.0 {
        return vec3f(0.0);
    }
    // As many triangles would give as much, were they alike.
    let alike = roots * roots / total;
    let points = clamp(POINTS * alike, f32(samples.x), f32(samples.y));
    let step = total / points;
#ifdef SPECULAR
    let drawn = select(0u, (samples.x + 1u) / 2u, shines(s));
#endif
    // How far along the sum the next point is, and the triangles that were looked at reach.
    var next = step * first;
    var reached = 0.0;
    var sum = vec3f(0.0);
    // What the triangles that were asked stand for: about `total`.
    var asked_of = 0.0;
    for (var i = 0u; i < count && next < total; i++) {
        let looked = looked_at(i, count, shift);
        let e = emitters[looked.row];
        let itself = unshadowed(e, s, start);
        let alone = looked.stands_for * itself;
        reached += alone;
        if alone <= 0.0 || reached <= next {
            continue;
        }
        let asks = ceil((reached - next) / step);
        next += asks * step;
        // Some point surely falls on what gives a step or more.
        let weight = max(step / alone, 1.0);
        // Of the points' irradiance: all, and what arrives. The light that arrives, its gloss, and what the matte
        // share loses.
        var all = 0.0;
        var arrived = 0.0;
#ifdef EMISSION_MAPS
        // Times the radiance of each point.
        var light = vec3f(0.0);
#endif
#ifdef SPECULAR
        var shine = vec3f(0.0);
        var lost = vec3f(0.0);
#endif
        // What the first points told, and how many times the others count.
        var told = 0.0;
        var others = 1.0;
        var asked = 0u;
        while asked < u32(asks) {
#ifndef EMISSION_MAPS
            // Of a picture all points are asked.
            if asked == FIRST_POINTS && (arrived == 0.0 || arrived == all) {
                if scramble(block ^ looked.row) % ONE_IN != 0u {
                    break;
                }
                told = f32(arrived > 0.0);
                others = f32(ONE_IN);
            }
#endif
            let p = towards(e, start, even_pair(asked, shift + looked.row));
            asked++;
            let cosine = dot(s.normal, p.direction);
            if cosine <= 0.0 || p.density <= 0.0 {
                continue;
            }
            let angle = e.density * e.area / p.density;
            all += cosine * angle;
            if is_free(start, p.direction, p.distance) {
                arrived += cosine * angle;
#ifdef EMISSION_MAPS
                light += cosine * angle * p.radiance;
#endif
#ifdef SPECULAR
                let even = itself / (step * angle);
                let share = even / (even + f32(drawn) * gloss::draw_density(s, p.direction));
                let less = taken(s, p.direction);
                shine += (glossy(s, p.direction) - less) * p.radiance * angle * share;
                lost += less * p.radiance * angle;
#endif
            }
        }
        if arrived > 0.0 {
            let seen = max(mix(told, arrived / all, others), 0.0);
#ifndef EMISSION_MAPS
            let light = arrived * e.radiance;
#endif
            var reflected = matte(s) / 3.14159265359 * light;
#ifdef SPECULAR
            reflected += lost;
#endif
            var part = form(e, start, s.normal) / arrived * reflected;
#ifdef SPECULAR
            part += shine / f32(asked) * (all / arrived);
#endif
            sum += seen * part * weight * looked.stands_for;
        }
        asked_of += weight * alone;
    }
    sum *= select(0.0, total / asked_of, asked_of > 0.0);
#ifdef SPECULAR
    for (var k = 0u; k < drawn; k++) {
        sum += met_by_lobe(s, start, draw_lobe(s, even_pair(k, scramble(shift + count))), step, drawn);
    }
#endif
    return sum;
}

#ifdef SPECULAR
/// What an emitter gives along one of `drawn` directions from the lobes, weighed against a point each `step` along the
/// sum of what emitters would give.
fn met_by_lobe(s: Surface, start: vec3f, direction: vec3f, step: f32, drawn: u32) -> vec3f {
    if dot(direction, s.normal) <= 0.0 {
        return vec3f(0.0);
    }
    let hit = trace::closest(start, direction);
    if hit.triangle == trace::NOTHING {
        return vec3f(0.0);
    }
    let t = trace::triangles[hit.triangle];
#ifdef EMISSION_MAPS
    if t.emitter == 0xffffffffu {
        return vec3f(0.0);
    }
    let e = emitters[t.emitter];
    let radiance = radiance_at(e, hit.at);
#else
    var e: Emitter;
    e.a = t.a;
    e.b = t.b;
    e.c = t.c;
    e.area = 0.5 * length(cross(t.b - t.a, t.c - t.a));
    e.radiance = materials[t.material].emission;
    let radiance = e.radiance;
#endif
    let cosine = -dot(normalize(cross(e.b - e.a, e.c - e.a)), direction);
    if cosine <= 0.0 || all(radiance <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    let even = unshadowed(e, s, start) / step * hit.distance * hit.distance / max(cosine * e.area, 1e-20);
    let shine = glossy(s, direction) - taken(s, direction);
    return shine * radiance / (even + f32(drawn) * gloss::draw_density(s, direction));
}
#endif

/// Times the area that the square of an emitter's distance is, from which on it is small.
const LARGE: f32 = 8.0;

/// About what an emitter would give a surface without shadows, the sum of the channels: more than nothing wherever
/// it gives some.
fn unshadowed(e: Emitter, s: Surface, start: vec3f) -> f32 {
    let a = e.a - start;
    let b = e.b - start;
    let c = e.c - start;
    // As long as twice the area.
    let across = cross(b - a, c - a);
    let facing = -dot(across, a);
    let reach = max(max(dot(a, s.normal), dot(b, s.normal)), dot(c, s.normal));
    if facing <= 0.0 || reach <= 0.0 {
        return 0.0;
    }
    let offset = (a + b + c) / 3.0;
    let square = dot(offset, offset);
    // Of one that is large or long from here the middle says little.
    let longest = max(max(dot(b - a, b - a), dot(c - a, c - a)), dot(c - b, c - b));
    if LARGE * max(e.area, 0.5 * longest) > square {
        return form(e, start, s.normal) * dot(e.radiance, vec3f(1.0));
    }
    let way = offset * inverseSqrt(max(square, 1e-20));
    let seen = max(0.5 * facing * inverseSqrt(max(square, 1e-20)), 0.05 * e.area);
    return max(dot(s.normal, way), 0.05) * seen / (square + e.area) * dot(e.radiance, vec3f(1.0));
}

/// An estimate of the same from one point chosen by power, weighed against a direction drawn by `lobe::scatter` with
/// the density that `scattered` gives for it (balance heuristic of Veach, 1995).
fn estimate(s: Surface, start: vec3f, p: Sample, scattered: f32) -> vec3f {
    let light = reflectance(s, p.direction) * p.radiance;
#ifdef CLEAR
    if p.density <= 0.0 || all(light <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    return free_share(start, p.direction, p.distance) * light / (p.density + scattered);
#else
    if p.density <= 0.0 || all(light <= vec3f(0.0)) || !is_free(start, p.direction, p.distance) {
        return vec3f(0.0);
    }
    return light / (p.density + scattered);
#endif
}
