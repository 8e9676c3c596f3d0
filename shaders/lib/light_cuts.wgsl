//! Light straight from many lights: groups that give little are lit as one, with a traced shadow each; as in Walter et
//! al., "Lightcuts: A Scalable Approach to Illumination" (SIGGRAPH 2005). How many groups that takes hardly grows with
//! the lights.
#define_import_path lightgraph::light_cuts
#import lightgraph::light_tree::place
#import lightgraph::lights::{Light, arrival}
#import lightgraph::lobe::reflectance
#import lightgraph::gloss::matte
#import lightgraph::surface::Surface
#import lightgraph::trace::{FAR, is_free, leave}

struct Tree {
    lights: u32,
    directional_lights: u32,
    light_leaves: u32,
}
var<uniform> tree: Tree;
/// As `lightgraph::light_tree` has them.
var light_nodes: texture_2d<f32>;

/// A group is looked into for a first estimate unless its box is as small as this many distances from it.
const ROUGHLY: f32 = 1.0;

/// The light of a row; `end`: where its shadow is traced to.
struct Lamp {
    light: Light,
    end: vec3f,
}

fn lamp(row: u32) -> Lamp {
    let at = place(row);
    let a = textureLoad(light_nodes, at, 0);
    let b = textureLoad(light_nodes, at + vec2u(1u, 0u), 0);
    let c = textureLoad(light_nodes, at + vec2u(2u, 0u), 0);
    let d = textureLoad(light_nodes, at + vec2u(3u, 0u), 0);
    return Lamp(Light(u32(d.w), a.xyz, b.xyz, c.xyz, a.w, b.w, c.w, 0u, 0u), d.xyz);
}

/// Sum of the channels.
fn brightness(color: vec3f) -> f32 {
    return dot(color, vec3f(1.0));
}

/// What a group can give a surface.
struct Reach {
    /// Brightness of what the surface reflects of it at most: 0 for what is below its horizon.
    most: f32,
    /// Edge over distance of its box, squared.
    spread: f32,
}

fn reach(s: Surface, row: u32) -> Reach {
    let at = place(row);
    let lower = textureLoad(light_nodes, at + vec2u(4u, 0u), 0).xyz;
    let upper = textureLoad(light_nodes, at + vec2u(5u, 0u), 0).xyz;
    let half = 0.5 * (upper - lower);
    let height = dot(s.normal, lower + half - s.position) + dot(abs(s.normal), half);
    if any(half < vec3f(0.0)) || height <= 0.0 {
        return Reach(0.0, 0.0);
    }
    let nearest = clamp(s.position, lower, upper) - s.position;
    let distance_squared = max(dot(nearest, nearest), 1e-12);
    let cosine = min(height * inverseSqrt(distance_squared), 1.0);
    var share = matte(s) * (cosine / 3.14159265359);
#ifdef SPECULAR
    share += vec3f(s.specular * (s.shininess + 1.0) / 6.28318530718);
#endif
    let intensity = textureLoad(light_nodes, at + vec2u(2u, 0u), 0).xyz;
    return Reach(brightness(share * intensity) / distance_squared, 4.0 * dot(half, half) / distance_squared);
}

/// The row that comes after a group, all in it left out; 1 after the last.
fn after(row: u32) -> u32 {
    let next = row + 1u;
    return next >> countTrailingZeros(next);
}

/// What all groups give without shadows, roughly: brightness of what the surface reflects.
fn estimate(s: Surface) -> f32 {
    var sum = 0.0;
    var row = 1u;
    loop {
        let r = reach(s, row);
        if r.most > 0.0 && row < tree.light_leaves && r.spread > ROUGHLY * ROUGHLY {
            row *= 2u;
            continue;
        }
        if r.most > 0.0 {
            let a = arrival(lamp(row).light, s.position);
            sum += brightness(reflectance(s, a.direction) * a.irradiance);
        }
        row = after(row);
        if row == 1u {
            break;
        }
    }
    return sum;
}

/// A walk through the groups that are lit as one.
struct Cut {
    /// The one found last; 0 for none left.
    row: u32,
    /// Where the walk goes on; 1 after its end.
    next: u32,
    /// Rows looked at.
    looked: u32,
}

/// The next group on the way, the first of all from `Cut(0, 0, 0)`, that gives `limit` at most or is a single light.
fn follow(s: Surface, before: Cut, limit: f32) -> Cut {
    var cut = before;
    var row = select(cut.next, 1u, cut.next == 0u);
    if cut.next == 1u {
        return Cut(0u, 1u, cut.looked);
    }
    cut.row = 0u;
    loop {
        let r = reach(s, row);
        cut.looked++;
        if r.most > limit && row < tree.light_leaves {
            row *= 2u;
            continue;
        }
        if r.most > 0.0 {
            cut.row = row;
        }
        row = after(row);
        if row == 1u || cut.row != 0u {
            break;
        }
    }
    cut.next = row;
    return cut;
}

/// What a group may give without being looked into, where all may be wrong by a share `error` of their light a group.
fn limit_of(s: Surface, error: f32) -> f32 {
    if error <= 0.0 {
        return 0.0;
    }
    return error * estimate(s);
}

/// What a surface reflects of a light, with its shadow. `start`: where rays leave the surface.
fn lit_by(s: Surface, l: Lamp, start: vec3f) -> vec3f {
    let a = arrival(l.light, s.position);
    let reflected = reflectance(s, a.direction) * a.irradiance;
    if all(reflected <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    var way = l.end - start;
    var end = length(way);
    way /= max(end, 1e-20);
    if l.light.kind == 2u {
        way = a.direction;
        end = FAR;
    }
    return select(vec3f(0.0), reflected, is_free(start, way, end));
}

/// Radiance that a surface reflects towards its viewer straight from all lights. Each group that is lit as one is wrong
/// by a share `error` of all light without shadows at most; with 0 each light is lit by itself.
fn reflected_light(s: Surface, error: f32) -> vec3f {
    let start = leave(s.position, s.normal + s.view);
    let limit = limit_of(s, error);
    var sum = vec3f(0.0);
    var cut = follow(s, Cut(), limit);
    while cut.row != 0u {
        sum += lit_by(s, lamp(cut.row), start);
        cut = follow(s, cut, limit);
    }
    for (var i = 0u; i < tree.directional_lights; i++) {
        sum += lit_by(s, lamp(tree.light_leaves + tree.lights - 1u - i), start);
    }
    return sum;
}

/// Groups that are lit as one, and rows looked at for it.
fn effort(s: Surface, error: f32) -> vec2u {
    let limit = limit_of(s, error);
    var found = 0u;
    var cut = follow(s, Cut(), limit);
    while cut.row != 0u {
        found++;
        cut = follow(s, cut, limit);
    }
    return vec2u(found, cut.looked);
}
