//! What a probe sees through a face of its cube, as capture.wgsl has it, of few triangles: each lane looks at all of
//! them, for eight texels. A face is an instance.
#import lightgraph::cube
#import lightgraph::hit
#import lightgraph::instances
#import lightgraph::packed_surface::pack
#import lightgraph::probe_views::depths
#import lightgraph::probes
#import lightgraph::raster::edge
#import lightgraph::trace::{FAR, Hit, NOTHING, corners}

struct Params {
    cube_surface_tile: u32,
    cube_surface_columns: u32,
    triangles: u32,
}
var<uniform> params: Params;
var cube_surface: texture_storage_2d<rgba32uint, write>;
/// A place on an edge belongs to what lies to its right, or below: texels, less than the lattice that edges lie on.
const HAIR = vec2f(1.0 / 16384.0, 1.0 / 65536.0);

/// Of two triangles as near as rounding lets them be the first shows, as in a draw.
const CLEARLY: f32 = 1.00001;

/// A probe's face.
struct View {
    probe: vec3f,
    tile: u32,
    face: u32,
    /// Texels along it.
    edge: u32,
    /// Metres to its near plane.
    near: f32,
}

/// A point of the world in texels of the face, times the depth, and the depth.
fn place(view: View, point: vec3f) -> vec3f {
    let p = cube::inward(view.face, point - view.probe);
    return vec3f(0.5 * f32(view.edge) * (p.xy + p.z) - cube::BESIDE * p.z, p.z);
}

/// How a triangle shows on a face, by row with a place `(x, y, 1)` in texels: the signs tell on which side of its edges
/// the place lies, none less than 0 for inside, and what follows is the inverse of its plane's depth there.
struct Shown {
    x: vec4f,
    y: vec4f,
    start: vec4f,
}

fn shown(view: View, triangle: u32) -> Shown {
    let world = corners(triangle);
    let a = place(view, world[0]);
    let b = place(view, world[1]);
    let c = place(view, world[2]);
    let volume = dot(a, cross(b, c));
    let plane = cross(b - a, c - a) * (1.0 / volume);
    let sides = transpose(sign(volume) * mat3x3f(edge(a, b, view.near), edge(b, c, view.near), edge(c, a, view.near)));
    return Shown(vec4f(sides[0], plane.x), vec4f(sides[1], plane.y), vec4f(sides[2], plane.z));
}

/// What four texels in a row show.
struct Row {
    /// The inverse of the depth.
    inverse: vec4f,
    triangle: vec4u,
}

/// A row with a triangle more, as far as it lies beyond the near plane. `start`: how it shows at the first texel;
/// `step`: and what changes to the next.
fn with_triangle(before: Row, triangle: u32, start: vec4f, step: vec4f, near: f32) -> Row {
    let along = vec4f(0.0, 1.0, 2.0, 3.0);
    let side = min(min(start.x + along * step.x, start.y + along * step.y), start.z + along * step.z);
    let inverse = start.w + along * step.w;
    let nearest = (side >= vec4f(0.0)) & (inverse > CLEARLY * before.inverse) & (inverse <= vec4f(1.0 / near));
    return Row(select(before.inverse, inverse, nearest), select(before.triangle, vec4u(triangle), nearest));
}

/// What a ray through a texel meets of a triangle that shows there at a distance: on its plane, but not where rounding
/// of corners puts that of a surface seen nearly edge on.
fn meet(triangle: u32, probe: vec3f, ray: vec3f, distance: f32) -> Hit {
    let world = corners(triangle);
    let a = world[0] - probe;
    let b = world[1] - probe;
    let c = world[2] - probe;
    let volumes = vec3f(dot(cross(c, b), ray), dot(cross(a, c), ray), dot(cross(b, a), ray));
    let sum = volumes.x + volumes.y + volumes.z;
    let normal = cross(b - a, c - a);
    let slope = dot(normal, ray);
    let met = clamp(dot(normal, a) / slope, 0.8 * distance, 1.25 * distance);
    let known = slope != 0.0 && sum != 0.0;
    return Hit(
        select(distance, met, known),
        triangle,
        select(vec2f(1.0 / 3.0), clamp(volumes.yz / sum, vec2f(0.0), vec2f(1.0)), known),
    );
}

/// Puts down what a texel of the face shows.
fn keep(view: View, texel: vec2u, triangle: u32, inverse: f32) {
    if any(texel >= vec2u(view.edge)) {
        return;
    }
    let ray = cube::direction_beside(view.face, texel, view.edge);
    let slant = cube::inward(view.face, ray).z;
    var hit = Hit(FAR, NOTHING, vec2f(0.0));
    if triangle != NOTHING {
        hit = meet(triangle, view.probe, ray, 1.0 / (inverse * slant));
    }
    // The texel's width seen from the probe.
    let spread = sqrt(cube::solid_angle(texel, view.edge));
    let at = cube::unplace(view.tile, texel, view.edge, params.cube_surface_columns);
    textureStore(cube_surface, at, pack(hit::record(hit::describe(hit, view.probe, ray, spread))));
}

@compute @workgroup_size(#{LANES})
fn capture(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let size = params.cube_surface_tile;
    let across = (size + 3u) / 4u;
    let block = instances::within(group).x * #{LANES}u + lane;
    let first = vec2u(block % across * 4u, block / across * 2u);
    let tile = instances::number(group);
    if first.y >= size {
        return;
    }
    let probe = probes::position(probes::coordinates(tile / 6u));
    let range = depths();
    let view = View(probe, tile, tile % 6u, size, range.x);
    let at = vec2f(first) + 0.5 + HAIR;
    var upper = Row(vec4f(1.0 / range.y), vec4u(NOTHING));
    var lower = upper;
    for (var i = 0u; i < params.triangles; i++) {
        let t = shown(view, i);
        let start = t.start + at.x * t.x + at.y * t.y;
        upper = with_triangle(upper, i, start, t.x, view.near);
        lower = with_triangle(lower, i, start + t.y, t.x, view.near);
    }
    for (var i = 0u; i < 4u; i++) {
        keep(view, first + vec2u(i, 0u), upper.triangle.x, upper.inverse.x);
        keep(view, first + vec2u(i, 1u), lower.triangle.x, lower.inverse.x);
        // The next one comes first: a number to pick it by costs a software driver more.
        upper = Row(upper.inverse.yzwx, upper.triangle.yzwx);
        lower = Row(lower.inverse.yzwx, lower.triangle.yzwx);
    }
}
