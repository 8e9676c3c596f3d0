//! Rays against the scene's triangles, through the boxes of the table `bvh`. With TRIANGLE_UNIFORMS the triangles lie
//! in a uniform: for scenes that have few.
#define_import_path lightgraph::trace
#ifdef MASKS
#import lightgraph::surface::{Point, Wide, base_color, is_hole, materials}
#endif

struct Box {
    lower: vec3f,
    /// Of a leaf: its first triangle. Else: the row of its first child; the second is the next.
    first: u32,
    upper: vec3f,
    /// Of a leaf: its triangles. Else 0.
    count: u32,
}
var<storage, read> bvh: array<Box>;

struct Triangle {
    a: vec3f,
    material: u32,
    b: vec3f,
    c: vec3f,
    na: vec3f,
    nb: vec3f,
    nc: vec3f,
#ifdef TEXTURES
    uva: vec2f,
    uvb: vec2f,
    uvc: vec2f,
#endif
#ifdef SECOND_UVS
    uv2a: vec2f,
    uv2b: vec2f,
    uv2c: vec2f,
#endif
#ifdef VERTEX_COLORS
    ca: vec4f,
    cb: vec4f,
    cc: vec4f,
#endif
#ifdef NORMAL_MAPS
    ta: vec4f,
    tb: vec4f,
    tc: vec4f,
#endif
#ifdef EMISSION_MAPS
    /// Row of `emitters`, 0xffffffff for none.
    emitter: u32,
#endif
}
#ifdef TRIANGLE_UNIFORMS
var<uniform> triangles: array<Triangle, #{TRIANGLE_ROWS}>;
#else
var<storage, read> triangles: array<Triangle>;
#endif

#ifdef TRACE_TEXELS
/// Rows of `bvh` in two texels each and the corners in `triangles` in three, for drivers that fetch four numbers of a
/// texture in the time that one of a table takes.
var box_texels: texture_storage_2d<rgba32uint, read>;
var corner_texels: texture_storage_2d<rgba32uint, read>;

fn box_at(row: u32) -> Box {
    // Both lie in one line.
    let place = line_place(2u * row);
    let low = textureLoad(box_texels, place);
    let high = textureLoad(box_texels, place + vec2u(1u, 0u));
    return Box(bitcast<vec3f>(low.xyz), low.w, bitcast<vec3f>(high.xyz), high.w);
}

/// The corners of a triangle, a column each.
fn corners(index: u32) -> mat3x3f {
    return mat3x3f(
        bitcast<vec3f>(textureLoad(corner_texels, line_place(3u * index)).xyz),
        bitcast<vec3f>(textureLoad(corner_texels, line_place(3u * index + 1u)).xyz),
        bitcast<vec3f>(textureLoad(corner_texels, line_place(3u * index + 2u)).xyz),
    );
}

/// Where a texel of a table lies.
fn line_place(texel: u32) -> vec2u {
    return vec2u(texel % 4096u, texel / 4096u);
}
#else
fn box_at(row: u32) -> Box {
    return bvh[row];
}

fn corners(index: u32) -> mat3x3f {
    return mat3x3f(triangles[index].a, triangles[index].b, triangles[index].c);
}
#endif

struct Extent {
    bounds_min: vec3f,
    bounds_max: vec3f,
}
var<uniform> extent: Extent;

/// What a ray meets.
struct Hit {
    /// Metres along the ray; the ray's end where it meets nothing.
    distance: f32,
    /// 0xffffffff where it meets nothing.
    triangle: u32,
    /// Barycentric coordinates of the corners b and c.
    at: vec2f,
}

const NOTHING: u32 = 0xffffffffu;
/// Metres: farther than any scene.
const FAR: f32 = 1e30;
/// The table's documentation bounds the depth of the leaves by 47.
const STACK: u32 = 48u;

/// How far from a surface rays start that leave it: 1e-5 of the scene's size or of its distance from the origin, some
/// eighty times the rounding of coordinates.
fn clearance() -> f32 {
    let size = max(max(abs(extent.bounds_min), abs(extent.bounds_max)), extent.bounds_max - extent.bounds_min);
    return 1e-5 * max(max(size.x, size.y), size.z);
}

/// A start for rays that leave a surface at `point` on the side that the unit `normal` points to.
fn leave(point: vec3f, normal: vec3f) -> vec3f {
    return point + clearance() * normal;
}

/// Reciprocals of a direction's components; those near 0 count as 1e-20.
fn reciprocal(direction: vec3f) -> vec3f {
    let tiny = select(vec3f(1e-20), vec3f(-1e-20), direction < vec3f(0.0));
    return 1.0 / select(direction, tiny, abs(direction) < vec3f(1e-20));
}

/// Where a ray enters and leaves a box, in distances from 0 to `end`. The ray misses the box if `first` exceeds `last`.
struct Span {
    first: f32,
    last: f32,
}

/// `turned` is true for axes along which the ray's direction is negative.
fn span(box: Box, origin: vec3f, inverse: vec3f, turned: vec3<bool>, end: f32) -> Span {
    let near = (select(box.lower, box.upper, turned) - origin) * inverse;
    let far = (select(box.upper, box.lower, turned) - origin) * inverse;
    let first = larger(larger(near.x, near.y), larger(near.z, 0.0));
    return Span(first, smaller(smaller(far.x, far.y), smaller(far.z, end)));
}

/// `max` and `min` that don't test for NaN: llvmpipe takes two instructions for them and three for the built-in ones.
fn larger(a: f32, b: f32) -> f32 {
    return select(b, a, a > b);
}

fn smaller(a: f32, b: f32) -> f32 {
    return select(b, a, a < b);
}

#ifdef MASKS
/// Whether a triangle has a hole at barycentric coordinates of its corners b and c.
fn is_open(index: u32, at: vec2f) -> bool {
    let m = materials[triangles[index].material];
    if m.alpha_cutoff <= 0.0 {
        return false;
    }
#ifdef CLEAR
    // Who follows paths sees what is there in part, or lets light through.
    if m.alpha_blend != 0u || (m.transmission > 0.0 && m.alpha_cutoff > 1.0) {
        return false;
    }
#endif
    let weights = vec3f(1.0 - at.x - at.y, at);
    var p: Point;
    var wide: Wide;
#ifdef TEXTURES
    p.uv = mat3x2f(triangles[index].uva, triangles[index].uvb, triangles[index].uvc) * weights;
#endif
#ifdef SECOND_UVS
    p.second_uv = mat3x2f(triangles[index].uv2a, triangles[index].uv2b, triangles[index].uv2c) * weights;
#endif
#ifdef VERTEX_COLORS
    p.color = vec4f(dot(vec3f(triangles[index].ca.a, triangles[index].cb.a, triangles[index].cc.a), weights));
#endif
    return is_hole(m, base_color(m, p, wide).a);
}
#endif

/// How many times its distance the back of a triangle is away: of a front and a back in one place, of which rounding
/// could make either the nearer, rays meet the front.
const BACK: f32 = 1.000004;

/// The hit with one triangle nearer than `best` and beyond `start`, or `best`; of two as near the one in the first row.
/// So what a ray meets does not depend on the order in which the search comes to the leaves.
///
/// Inside is decided by the signs of the volumes that the ray spans with each edge, alike for both triangles at
/// an edge, so that no ray slips between them. The distance is that to the triangle's plane, clamped to the distances
/// of its corners, since rounding moves the plane's far along rays that graze it.
fn meet(index: u32, origin: vec3f, direction: vec3f, start: f32, best: Hit) -> Hit {
    let corner = corners(index);
    let a = corner[0] - origin;
    let b = corner[1] - origin;
    let c = corner[2] - origin;
    let volumes = vec3f(dot(cross(c, b), direction), dot(cross(a, c), direction), dot(cross(b, a), direction));
    let inside = all(volumes >= vec3f(0.0)) || all(volumes <= vec3f(0.0));
    let normal = cross(b - a, c - a);
    let slope = dot(normal, direction);
    let sum = volumes.x + volumes.y + volumes.z;
    if !inside || slope == 0.0 || sum == 0.0 {
        return best;
    }
    let plane = dot(normal, a) / slope;
    let along = vec3f(dot(a, direction), dot(b, direction), dot(c, direction));
    let nearest = smaller(along.x, smaller(along.y, along.z));
    let own = larger(nearest, smaller(plane, larger(along.x, larger(along.y, along.z))));
    let distance = select(own, BACK * own, slope > 0.0);
    let first = distance == best.distance && best.triangle != NOTHING && index < best.triangle;
    if plane > start && (distance < best.distance || first) {
#ifdef MASKS
        if is_open(index, volumes.yz / sum) {
            return best;
        }
#endif
        return Hit(distance, index, volumes.yz / sum);
    }
    return best;
}

/// What waits to be looked into. Arrays of a function begin as zero each time that it is called.
var<private> stack: array<i32, STACK>;

/// What a box leads to, in one word: the row of its first child; for a leaf, which holds at most 8 triangles, the
/// complement of the first triangle and their number.
fn below(box: Box) -> i32 {
    return select(i32(box.first), ~i32(box.first << 4u | box.count), box.count > 0u);
}

/// Nothing is left: a leaf without triangles.
const NOWHERE: i32 = -1;

/// What a ray meets first between `start` and `end`. With `any_will_do`, whatever it finds first.
///
/// Lanes that run together go down to a leaf each, then look at their leaves together: one that is in a box while
/// another is at a triangle would wait for it in every round (Aila and Laine, "Understanding the Efficiency of Ray
/// Traversal on GPUs", 2009).
///
/// Loops test at the end of their bodies: where one tests at its start, llvmpipe runs the body once more with no lane.
fn search(origin: vec3f, direction: vec3f, start: f32, end: f32, any_will_do: bool) -> Hit {
    let inverse = reciprocal(direction);
    let turned = inverse < vec3f(0.0);
    var best = Hit(end, NOTHING, vec2f(0.0));
    var waiting = 0u;
    var here = below(box_at(0u));
    loop {
        loop {
            if here > NOWHERE {
                let left = box_at(u32(here));
                let right = box_at(u32(here) + 1u);
                let one = span(left, origin, inverse, turned, best.distance);
                let two = span(right, origin, inverse, turned, best.distance);
                let meets_one = one.first <= one.last;
                let meets_two = two.first <= two.last;
                let swap = meets_two && (!meets_one || two.first < one.first);
                // Every lane writes, even one that keeps nothing: llvmpipe branches lane by lane where some don't.
                stack[waiting] = select(below(right), below(left), swap);
                waiting += u32(meets_one && meets_two);
                if meets_one || meets_two {
                    here = select(below(left), below(right), swap);
                } else if waiting == 0u {
                    here = NOWHERE;
                } else {
                    waiting--;
                    here = stack[waiting];
                }
            }
            if here <= NOWHERE {
                break;
            }
        }
        let leaf = u32(~here);
        let count = leaf & 15u;
        var i = 0u;
        loop {
            if i < count {
                best = meet((leaf >> 4u) + i, origin, direction, start, best);
            }
            i++;
            if i >= count {
                break;
            }
        }
        if here == NOWHERE || waiting == 0u || any_will_do && best.triangle != NOTHING {
            break;
        }
        waiting--;
        here = stack[waiting];
    }
    return best;
}

/// What a ray meets first; both sides of triangles count.
fn closest(origin: vec3f, direction: vec3f) -> Hit {
    return search(origin, direction, 0.0, FAR, false);
}

/// What a ray meets first between `start` and `end` metres.
fn closest_between(origin: vec3f, direction: vec3f, start: f32, end: f32) -> Hit {
    return search(origin, direction, start, end, false);
}

/// Of the way to a light, the share that must be free: what it lies on would be in its way.
const REACH: f32 = 0.9999;

/// Whether a ray is free up to what gives light `end` metres away.
fn is_free(origin: vec3f, direction: vec3f, end: f32) -> bool {
    return search(origin, direction, 0.0, REACH * end, true).triangle == NOTHING;
}
