//! Built in: the draws of each member of a pass, each over the clusters of a part of the scene that its frustum meets.

struct Cluster {
    /// Corners of the box in the world, metres.
    lower: vec3f,
    upper: vec3f,
    /// Indices of the mesh.
    first: u32,
    count: u32,
    /// Sides of the box round everything that it lies in: bits 0 to 2 the lower ones along x, y, z, 3 to 5 the upper
    /// ones.
    sides: u32,
}
var<storage, read> clusters: array<Cluster>;

struct Frustum {
    view_projection: mat4x4f,
}
var<storage, read> frusta: array<Frustum>;

/// As WebGPU reads the arguments of an indexed indirect draw.
struct Draw {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}
var<storage, read_write> draws: array<Draw>;

struct Culling {
    members: u32,
    /// The first one's number.
    first_member: u32,
    /// Of all that it draws.
    first_cluster: u32,
    /// Clusters that the draws of a member's first part share, and how many draws these are.
    first_clusters: u32,
    first_draws: u32,
    /// The same of its second part, whose clusters follow.
    second_clusters: u32,
    second_draws: u32,
    /// Not 0: what can hide nothing from the eye is left out.
    occluders: u32,
}
var<uniform> culling: Culling;

/// Whether a box lies on the outer side of a plane for certain: `dot(plane, p) < 0` for all of it, rounding included.
fn outside(plane: vec4f, middle: vec3f, half: vec3f) -> bool {
    let reach = dot(abs(plane.xyz), half);
    let size = dot(abs(plane.xyz), abs(middle)) + abs(plane.w);
    return dot(plane.xyz, middle) + plane.w + reach < -1e-5 * (size + reach);
}

/// Whether a box meets the volume that `rows`, those of a view-projection matrix, keep (-w..w, 0..w in depth). What is
/// not a number keeps everything.
fn meets(rows: mat4x4f, lower: vec3f, upper: vec3f) -> bool {
    let middle = 0.5 * (lower + upper);
    let half = 0.5 * (upper - lower);
    return !(outside(rows[0] + rows[3], middle, half)
        || outside(rows[3] - rows[0], middle, half)
        || outside(rows[1] + rows[3], middle, half)
        || outside(rows[3] - rows[1], middle, half)
        || outside(rows[2], middle, half)
        || outside(rows[3] - rows[2], middle, half));
}

/// Where the lines of sight of a view begin: a point (w above 0), or the direction to it (w 0).
fn eye_of(rows: mat4x4f) -> vec4f {
    let a = rows[0];
    let b = rows[1];
    let c = rows[3];
    let meet = a.w * cross(b.xyz, c.xyz) + b.w * cross(c.xyz, a.xyz) + c.w * cross(a.xyz, b.xyz);
    let eye = vec4f(-meet, dot(a.xyz, cross(b.xyz, c.xyz)));
    // Depths fall towards it.
    return select(eye, -eye, dot(rows[2], eye) > 0.0);
}

/// Whether a cluster lies in a side of the box round everything, of which the eye is on the inner side: then it comes
/// between the eye and nothing. What is not a number does not.
fn hides_nothing(c: Cluster, eye: vec4f) -> bool {
    let bits = vec3u(c.sides) >> vec3u(0u, 1u, 2u);
    let below = (bits & vec3u(1u)) == vec3u(1u);
    let above = ((bits >> vec3u(3u)) & vec3u(1u)) == vec3u(1u);
    return any(below & (eye.xyz > c.upper * eye.w)) || any(above & (eye.xyz < c.lower * eye.w));
}

/// So many lanes look at the clusters of a draw.
const LANES: u32 = 8u;
const DRAWS: u32 = 8u;

/// Of each draw: the first index of what is seen, with its bits turned round, and the end of it. Both begin as 0.
var<workgroup> firsts: array<atomic<u32>, DRAWS>;
var<workgroup> ends: array<atomic<u32>, DRAWS>;

/// A few lanes a draw: from the first to the last cluster that is seen of an equal share of the clusters.
@compute @workgroup_size(64)
fn cull(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let slot = lane / LANES;
    let draw = (group.y * groups.x + group.x) * DRAWS + slot;
    let draws_each = culling.first_draws + culling.second_draws;
    let row = draw / draws_each;
    let there = row < culling.members;
    let member = culling.first_member + row;
    var place = draw % draws_each;
    var base = 0u;
    var count = culling.first_clusters;
    var shares = culling.first_draws;
    if place >= culling.first_draws {
        place -= culling.first_draws;
        base = culling.first_clusters;
        count = culling.second_clusters;
        shares = culling.second_draws;
    }
    let share = (count + shares - 1u) / max(shares, 1u);
    let begin = base + min(place * share, count);
    let end = base + min((place + 1u) * share, count);
    let known = member < arrayLength(&frusta);
    let rows = transpose(frusta[min(member, arrayLength(&frusta) - 1u)].view_projection);
    let eye = eye_of(rows);
    var first = 0xffffffffu;
    var last = 0u;
    for (var i = begin + lane % LANES; there && i < end; i += LANES) {
        let c = clusters[culling.first_cluster + i];
        if culling.occluders != 0u && known && hides_nothing(c, eye) {
            continue;
        }
        if !known || meets(rows, c.lower, c.upper) {
            first = min(first, c.first);
            last = c.first + c.count;
        }
    }
    if last != 0u {
        atomicMax(&firsts[slot], ~first);
        atomicMax(&ends[slot], last);
    }
    workgroupBarrier();
    if !there || lane % LANES != 0u {
        return;
    }
    first = ~atomicLoad(&firsts[slot]);
    last = atomicLoad(&ends[slot]);
    let seen = first < last;
    draws[draw] = Draw(select(0u, last - first, seen), select(0u, 1u, seen), select(0u, first, seen), 0, member);
}
