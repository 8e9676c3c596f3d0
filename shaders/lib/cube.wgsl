//! Cube maps in WebGPU's convention: faces +X -X +Y -Y +Z -Z, columns along `right`, rows along `down`.
#define_import_path lightgraph::cube

/// The frame of a face: (u, v) of -1..1 on it lies in the direction `forward + u * right + v * down`.
struct Axes {
    forward: vec3f,
    right: vec3f,
    down: vec3f,
}

fn axes(face: u32) -> Axes {
    switch face {
        case 0u: { return Axes(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, -1.0), vec3f(0.0, -1.0, 0.0)); }
        case 1u: { return Axes(vec3f(-1.0, 0.0, 0.0), vec3f(0.0, 0.0, 1.0), vec3f(0.0, -1.0, 0.0)); }
        case 2u: { return Axes(vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, 1.0)); }
        case 3u: { return Axes(vec3f(0.0, -1.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3f(0.0, 0.0, -1.0)); }
        case 4u: { return Axes(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), vec3f(0.0, -1.0, 0.0)); }
        default: { return Axes(vec3f(0.0, 0.0, -1.0), vec3f(-1.0, 0.0, 0.0), vec3f(0.0, -1.0, 0.0)); }
    }
}

/// Where a texel's surface is looked for and found, to the right of its centre and below it, in texels. Its light
/// counts as coming through the centre, so that sums over all texels cancel as the cube's symmetries ask. Where the
/// scene and the lattice of probes have round proportions, edges pass exactly through centres: a hair beside them each
/// has a side. Drawing rounds corners to 1/256 of a texel; the hair is more, and not alike both ways, so that diagonals
/// have sides too.
const BESIDE = vec2f(1.5 / 256.0, 1.0 / 256.0);

/// The frame of a face of `edge`² texels that has those places where the other has their centres.
fn axes_beside(face: u32, edge: u32) -> Axes {
    let a = axes(face);
    let beside = 2.0 / f32(edge) * BESIDE;
    return Axes(a.forward, a.right - beside.x * a.forward, a.down - beside.y * a.forward);
}

/// Unit direction to that place of a texel.
fn direction_beside(face: u32, texel: vec2u, edge: u32) -> vec3f {
    return outward(face, within_beside(texel, edge));
}

/// Unit direction through the centre of a texel (column, row) of a face of `edge`² texels.
fn direction(face: u32, texel: vec2u, edge: u32) -> vec3f {
    return outward(face, within(texel, edge));
}

/// The same directions as a face has them, alike for all: for `outward`.
fn within_beside(texel: vec2u, edge: u32) -> vec3f {
    return normalize(vec3f((2.0 * (vec2f(texel) + BESIDE) + 1.0) / f32(edge) - 1.0, 1.0));
}

fn within(texel: vec2u, edge: u32) -> vec3f {
    return normalize(vec3f((2.0 * vec2f(texel) + 1.0) / f32(edge) - 1.0, 1.0));
}

/// A texel of a face.
struct FaceTexel {
    face: u32,
    texel: vec2u,
}

/// The face of `edge`² texels, and the texel on it, that a direction of any length meets.
fn locate(d: vec3f, edge: u32) -> FaceTexel {
    let face = face_of(d);
    let inner = inward(face, d);
    let at = inner.xy / max(inner.z, 1e-20);
    let texel = clamp((0.5 * at + 0.5) * f32(edge), vec2f(0.0), vec2f(f32(edge) - 1.0));
    return FaceTexel(face, vec2u(texel));
}

/// Exact solid angle of a texel of a face of `edge`² texels, in steradians; all of them sum to 4 pi.
///
/// By its two triangles (Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983): differences of
/// angles from the face's centre would cost small texels their digits.
fn solid_angle(texel: vec2u, edge: u32) -> f32 {
    let low = 2.0 * vec2f(texel) / f32(edge) - 1.0;
    let high = 2.0 * vec2f(texel + 1u) / f32(edge) - 1.0;
    let width = 2.0 / f32(edge);
    let a = vec3f(low, 1.0);
    let b = vec3f(high.x, low.y, 1.0);
    let c = vec3f(high, 1.0);
    let d = vec3f(low.x, high.y, 1.0);
    return triangle_angle(a, b, c, width * width) + triangle_angle(a, c, d, width * width);
}

/// Solid angle of a triangle from the origin; `volume` is that of the parallelepiped over its corners.
fn triangle_angle(a: vec3f, b: vec3f, c: vec3f, volume: f32) -> f32 {
    let lengths = vec3f(length(a), length(b), length(c));
    let whole = lengths.x * lengths.y * lengths.z;
    let tangent = volume / (whole + dot(a, b) * lengths.z + dot(a, c) * lengths.y + dot(b, c) * lengths.x);
    // Twice its arctangent, by that of half the angle, at most 0.27, as a series: drivers' own may be off by 1/50,000.
    let half = tangent / (1.0 + sqrt(1.0 + tangent * tangent));
    let s = half * half;
    return 4.0 * half * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s * (1.0 / 9.0 - s / 11.0)))));
}

/// Clip position of a point `offset` from the cube's centre, seen through a face of `edge`² texels (90 degrees,
/// right-handed world), `BESIDE` their centres. The image is a mirror image: the front of a triangle turns clockwise.
fn clip(offset: vec3f, face: u32, edge: u32, near: f32, far: f32) -> vec4f {
    let a = axes_beside(face, edge);
    let depth = dot(offset, a.forward);
    return vec4f(dot(offset, a.right), -dot(offset, a.down), far * (depth - near) / (far - near), depth);
}

/// How the inverse of the depth changes along a face of `edge`² texels, per unit of its (u, v), where a fragment is. On
/// a plane it is linear, beyond the plane's edges and its horizon too.
fn slope(at: vec4f, edge: u32) -> vec2f {
    return vec2f(dpdx(at.w), dpdy(at.w)) * 0.5 * f32(edge);
}

/// Unit normal, on the side away from the cube's centre, of a plane through the point `offset` from there. `slope`: as
/// the function of that name gives it.
fn plane(face: u32, offset: vec3f, slope: vec2f) -> vec3f {
    let a = axes(face);
    let depth = dot(offset, a.forward);
    let at = vec2f(dot(offset, a.right), dot(offset, a.down)) / depth;
    return normalize((1.0 / depth - dot(at, slope)) * a.forward + slope.x * a.right + slope.y * a.down);
}

/// Metres from the cube's centre to a plane, along a unit direction. `offset`: a point of the plane near it, from the
/// centre. It need not lie on the ray: drivers round corners to between 1/256 and 1/16 of a texel, which on a surface
/// seen nearly edge on is far.
fn along(direction: vec3f, offset: vec3f, normal: vec3f) -> f32 {
    let shown = length(offset);
    let slope = dot(direction, normal);
    // A ray that misses the surface by that rounding may meet its plane anywhere.
    let met = clamp(dot(offset, normal) / max(slope, 1e-20), 0.8 * shown, 1.25 * shown);
    return select(shown, met, slope > 0.0);
}

/// The matrix from the world to the clip position that `clip` gives, for a cube with its centre at `origin`, but for
/// what lies beside a texel's centre.
fn view_projection(origin: vec3f, face: u32, near: f32, far: f32) -> mat4x4f {
    let a = axes(face);
    let scale = far / (far - near);
    let middle = vec4f(
        -dot(origin, a.right),
        dot(origin, a.down),
        -scale * (dot(origin, a.forward) + near),
        -dot(origin, a.forward),
    );
    let x = vec4f(a.right.x, -a.down.x, scale * a.forward.x, a.forward.x);
    let y = vec4f(a.right.y, -a.down.y, scale * a.forward.y, a.forward.y);
    let z = vec4f(a.right.z, -a.down.z, scale * a.forward.z, a.forward.z);
    return mat4x4f(x, y, z, middle);
}

/// A direction in a face's frame: along `right`, `down` and `forward`. Without a branch, unlike `axes`.
fn inward(face: u32, d: vec3f) -> vec3f {
    let s = select(d, -d, (face & 1u) == 1u);
    let other = select(vec3f(s.x, -d.y, s.z), vec3f(d.x, s.z, s.y), (face >> 1u) == 1u);
    return select(other, vec3f(-s.z, -d.y, s.x), face < 2u);
}

/// The inverse of `inward`.
fn outward(face: u32, d: vec3f) -> vec3f {
    let s = select(d, -d, (face & 1u) == 1u);
    let other = select(vec3f(s.x, -d.y, s.z), vec3f(d.x, s.z, s.y), (face >> 1u) == 1u);
    return select(other, vec3f(s.z, -d.y, -s.x), face < 2u);
}

/// The face that a direction of any length meets.
fn face_of(d: vec3f) -> u32 {
    let size = abs(d);
    let beside = select(select(4u, 5u, d.z < 0.0), select(2u, 3u, d.y < 0.0), size.y >= size.z);
    return select(beside, select(0u, 1u, d.x < 0.0), size.x >= max(size.y, size.z));
}

/// A texel of an atlas: the tile it lies in, and its place there.
struct Place {
    tile: u32,
    texel: vec2u,
}

/// Where `texel` of an atlas with tiles of `edge` texels in rows of `columns` lies.
fn place(texel: vec2u, edge: u32, columns: u32) -> Place {
    let tile = texel / edge;
    return Place(tile.y * columns + tile.x, texel % edge);
}

/// The atlas texel of `texel` of tile number `tile`, less than 2^21.
fn unplace(tile: u32, texel: vec2u, edge: u32, columns: u32) -> vec2u {
    return corner(tile, edge, columns) + texel;
}

/// The same of its first texel, without a division of integers, which SIMD lanes do one by one. `tile` less than 2^21.
fn corner(tile: u32, edge: u32, columns: u32) -> vec2u {
    // The half keeps rounding of the quotient from reaching a whole number.
    let row = u32((f32(tile) + 0.5) / f32(columns));
    return vec2u(tile - row * columns, row) * edge;
}
