//! The table of `lightgraph::lobe_table`: harmonics of the lobes of every material at every angle to the viewer.
//!
//! Degree l of a lobe f at direction d of the plane of incidence is F(d) = (2l + 1)/(4 pi) * integral of f(w) P_l(w .
//! d), which is the sum over m of f's harmonics (l, m) times those of d. f is its own mirror image in that plane: half
//! of its harmonics are 0. Along the plane F is a sum of cos(k angle) for k = l, l - 2, …, and so is P_l itself, so
//! that the shares of the directions are a deconvolution: one sum over the angles between them.
//!
//! A cut series lets light in from behind the surface. Odd degrees of a step at the horizon are taken off, by as much
//! as leaves nothing of even light from behind: the least change that does so and keeps the lobe's energy.
#import lightgraph::gloss::{held, lobes, shines}
#import lightgraph::lobe_table::{ANGLES, DIRECTIONS}
#import lightgraph::sh::ORDER
#import lightgraph::surface::{Surface, materials}
#ifdef METALS
#import lightgraph::surface::mean_finish
#endif

var lobe_table: texture_storage_2d<rgba32float, write>;

/// As many as there are harmonics up to degree 14, and more than samples of a ring.
const LANES: u32 = 128u;
/// Harmonics that are their own mirror images: (l, m) has number l (l + 1)/2 + m.
const EVEN: u32 = (ORDER + 1u) * (ORDER + 2u) / 2u;
/// Sums: a degree and a direction each.
const SUMS: u32 = DIRECTIONS * DIRECTIONS;
/// Rings round the normal on the hemisphere, and samples of the half of a ring on one side of the plane of incidence.
const RINGS: u32 = 96u;
const STEPS: u32 = 96u;
const PI: f32 = 3.14159265359;

var<workgroup> cosines: array<f32, 4u * STEPS>;
var<workgroup> ring: array<vec3f, STEPS>;
/// The integral over the ring, times cos(m angle).
var<workgroup> waves: array<vec3f, DIRECTIONS>;
var<workgroup> harmonics: array<vec3f, EVEN>;
var<workgroup> degrees: array<vec3f, SUMS>;

/// In the frame of the surface: z along the normal, the viewer in the half plane of positive x.
fn surface(row: u32) -> Surface {
    // At a right angle the lobes of microfacets have a limit only.
    let angle = min(f32(row % ANGLES) / f32(ANGLES - 1u), 0.999) * 0.5 * PI;
    let m = materials[row / ANGLES];
    var s: Surface;
    s.normal = vec3f(0.0, 0.0, 1.0);
    s.view = vec3f(sin(angle), 0.0, cos(angle));
    s.material = row / ANGLES;
    s.specular = m.specular;
    s.shininess = m.shininess;
#ifdef METALS
    let mean = mean_finish(m);
    s.roughness = mean.x;
    s.metallic = mean.y;
#endif
    return held(s, ORDER);
}

fn legendre(degree: u32, x: f32) -> f32 {
    var low = 0.0;
    var here = 1.0;
    for (var l = 1u; l <= degree; l++) {
        let next = (f32(2u * l - 1u) * x * here - f32(l - 1u) * low) / f32(l);
        low = here;
        here = next;
    }
    return here;
}

/// Harmonic (l, m) in the plane of incidence, at an angle to the normal; by the recurrence of `lightgraph::sh`.
fn harmonic(l: u32, m: u32, angle: f32) -> f32 {
    let x = cos(angle);
    let y = sin(angle);
    let q = f32(m);
    var low = 0.0;
    var here = select(1.41421356237, 1.0, m == 0u) * 0.28209479177;
    for (var i = 1u; i <= m; i++) {
        here *= y * sqrt(f32(2u * i + 1u) / f32(2u * i));
    }
    for (var i = m + 1u; i <= l; i++) {
        let d = f32(i);
        let scale = (4.0 * d * d - 1.0) / (d * d - q * q);
        let back = ((d - 1.0) * (d - 1.0) - q * q) / (4.0 * (d - 1.0) * (d - 1.0) - 1.0);
        let next = sqrt(scale) * (x * here - sqrt(max(back, 0.0)) * low);
        low = here;
        here = next;
    }
    return here;
}

/// Degree l of a step that is 1 behind the surface, in Legendre polynomials of the cosine to the normal; of odd l.
fn behind(l: u32) -> f32 {
    return -0.5 * legendre(l - 1u, 0.0) * (1.0 + f32(l) / f32(l + 1u));
}

/// (2n choose n)/4^n.
fn central(n: u32) -> f32 {
    var value = 1.0;
    for (var i = 1u; i <= n; i++) {
        value *= f32(2u * i - 1u) / f32(2u * i);
    }
    return value;
}

/// What F at one direction counts in the share of another, `apart` directions away.
fn deconvolution(l: u32, apart: f32) -> f32 {
    let n = f32(DIRECTIONS);
    var sum = 0.0;
    for (var i = 0u; i <= l; i++) {
        let part = f32(2u * l + 1u) / (4.0 * PI) * central(i) * central(l - i);
        sum += cos((f32(l) - 2.0 * f32(i)) * PI * apart / n) / part;
    }
    return sum / (n * n);
}

/// A workgroup for a row.
@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let s = surface(group.x);
    for (var i = lane; i < 4u * STEPS; i += LANES) {
        cosines[i] = cos(0.5 * PI * f32(i) / f32(STEPS));
    }
    var l = 0u;
    while (l + 1u) * (l + 2u) / 2u <= lane {
        l++;
    }
    let m = lane - l * (l + 1u) / 2u;
    var sum = vec3f(0.0);
    // Nobody reads the rows of matte materials. A row is one material's: its lanes take the same way.
    let rings = select(0u, RINGS, shines(s));
    for (var i = 0u; i < rings; i++) {
        let polar = 0.5 * PI * (f32(i) + 0.5) / f32(RINGS);
        if lane < STEPS {
            let round = PI * (f32(lane) + 0.5) / f32(STEPS);
            let w = vec3f(sin(polar) * cos(round), sin(polar) * sin(round), cos(polar));
            // Both sides of the plane of incidence.
            let area = 2.0 * sin(polar) * (0.5 * PI / f32(RINGS)) * (PI / f32(STEPS));
            ring[lane] = lobes(s, w) * area;
        }
        workgroupBarrier();
        if lane < DIRECTIONS {
            var wave = vec3f(0.0);
            for (var k = 0u; k < STEPS; k++) {
                wave += ring[k] * cosines[lane * (2u * k + 1u) % (4u * STEPS)];
            }
            waves[lane] = wave;
        }
        workgroupBarrier();
        if lane < EVEN {
            sum += waves[m] * harmonic(l, m, polar);
        }
    }
    if lane < EVEN {
        harmonics[lane] = sum;
    }
    workgroupBarrier();
    for (var e = lane; e < SUMS; e += LANES) {
        let degree = e / DIRECTIONS;
        let angle = PI * f32(e % DIRECTIONS) / f32(DIRECTIONS);
        var f = vec3f(0.0);
        for (var i = 0u; i <= degree; i++) {
            f += harmonics[degree * (degree + 1u) / 2u + i] * harmonic(degree, i, angle);
        }
        degrees[e] = f;
    }
    workgroupBarrier();

    // What comes from behind, and how much of the step takes it off.
    var through = 0.5 * degrees[0] * 4.0 * PI;
    var square = 0.0;
    for (var i = 1u; i <= ORDER; i += 2u) {
        through += behind(i) * degrees[i * DIRECTIONS] * 4.0 * PI / f32(2u * i + 1u);
        square += behind(i) * behind(i) * 4.0 * PI / f32(2u * i + 1u);
    }
    let excess = select(vec3f(0.0), through / max(square, 1e-20), square > 0.0);

    for (var e = lane; e < SUMS; e += LANES) {
        let degree = e / DIRECTIONS;
        let j = e % DIRECTIONS;
        var share = vec3f(0.0);
        for (var i = 0u; i < DIRECTIONS; i++) {
            var f = degrees[degree * DIRECTIONS + i];
            if degree % 2u == 1u {
                f -= excess * behind(degree) * legendre(degree, cos(PI * f32(i) / f32(DIRECTIONS)));
            }
            share += f * deconvolution(degree, f32(i) - f32(j));
        }
        textureStore(lobe_table, vec2u(e, group.x), vec4f(share, 1.0));
    }
}
