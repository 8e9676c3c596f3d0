//! The table of `lightgraph::lobe_table`: harmonics of the lobes of every material at every angle to the viewer.
//!
//! Degree l of a lobe f at direction d of the plane of incidence is F(d) = (2l + 1)/(4 pi) * integral of f(w) P_l(w . d);
//! along the plane that is a sum of cos(k angle) for k = l, l - 2, …, and so is P_l itself, so that the shares of the
//! directions are a deconvolution: one sum over the angles between them.
//!
//! A cut series lets light in from behind the surface. Odd degrees of a step at the horizon are taken off, by as much
//! as leaves nothing of even light from behind: the least change that does so and keeps the lobe's energy.
#import lightgraph::gloss::{held, lobes, shines}
#import lightgraph::lobe_table::{ANGLES, DIRECTIONS, plane_direction}
#import lightgraph::sh::ORDER
#import lightgraph::surface::{Surface, materials}

var lobe_table: texture_storage_2d<rgba32float, write>;

const LANES: u32 = 64u;
/// Sums: a degree and a direction each.
const SUMS: u32 = DIRECTIONS * DIRECTIONS;
/// Samples of the half of the hemisphere on one side of the plane of incidence, along the polar angle and round it.
const STEPS: vec2u = vec2u(96u, 96u);
const PI: f32 = 3.14159265359;

var<workgroup> partial: array<vec3f, LANES>;
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
#ifdef GGX
    s.roughness = m.roughness;
    s.metallic = m.metallic;
#endif
    return held(s, ORDER);
}

/// Legendre polynomials of x up to ORDER.
fn legendre(x: f32) -> array<f32, DIRECTIONS> {
    var p: array<f32, DIRECTIONS>;
    p[0] = 1.0;
    var low = 0.0;
    var here = 1.0;
    for (var l = 1u; l <= ORDER; l++) {
        let next = (f32(2u * l - 1u) * x * here - f32(l - 1u) * low) / f32(l);
        low = here;
        here = next;
        p[l] = next;
    }
    return p;
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
    var sums: array<vec3f, SUMS>;
    // Nobody reads the rows of matte materials.
    let steps = select(0u, STEPS.x * STEPS.y, shines(s));
    for (var i = lane; i < steps; i += LANES) {
        let polar = 0.5 * PI * (f32(i / STEPS.y) + 0.5) / f32(STEPS.x);
        let round = PI * (f32(i % STEPS.y) + 0.5) / f32(STEPS.y);
        let w = vec3f(sin(polar) * cos(round), sin(polar) * sin(round), cos(polar));
        // Both sides of the plane of incidence.
        let area = 2.0 * sin(polar) * (0.5 * PI / f32(STEPS.x)) * (PI / f32(STEPS.y));
        let f = lobes(s, w) * area;
        for (var j = 0u; j < DIRECTIONS; j++) {
            var p = legendre(dot(w, plane_direction(j, vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0))));
            for (var l = 0u; l <= ORDER; l++) {
                sums[l * DIRECTIONS + j] += f * p[l];
            }
        }
    }
    for (var e = 0u; e < SUMS; e++) {
        partial[lane] = sums[e];
        for (var half = LANES / 2u; half > 0u; half /= 2u) {
            workgroupBarrier();
            if lane < half {
                partial[lane] += partial[lane + half];
            }
        }
        if lane == 0u {
            degrees[e] = partial[0] * f32(2u * (e / DIRECTIONS) + 1u) / (4.0 * PI);
        }
        workgroupBarrier();
    }

    // The step: 1 behind the surface, in Legendre polynomials of the cosine to the normal.
    let at_horizon = legendre(0.0);
    var step: array<f32, DIRECTIONS>;
    var through = 0.5 * degrees[0] * 4.0 * PI;
    var square = 0.0;
    for (var l = 1u; l <= ORDER; l += 2u) {
        let beyond = -f32(l) / f32(l + 1u) * at_horizon[l - 1u];
        step[l] = -0.5 * (at_horizon[l - 1u] - beyond);
        through += step[l] * degrees[l * DIRECTIONS] * 4.0 * PI / f32(2u * l + 1u);
        square += step[l] * step[l] * 4.0 * PI / f32(2u * l + 1u);
    }
    let excess = select(vec3f(0.0), through / max(square, 1e-20), square > 0.0);

    for (var e = lane; e < SUMS; e += LANES) {
        let l = e / DIRECTIONS;
        let j = e % DIRECTIONS;
        var share = vec3f(0.0);
        for (var i = 0u; i < DIRECTIONS; i++) {
            var p = legendre(cos(PI * f32(i) / f32(DIRECTIONS)));
            let f = degrees[l * DIRECTIONS + i] - excess * step[l] * p[l];
            share += f * deconvolution(l, f32(i) - f32(j));
        }
        textureStore(lobe_table, vec2u(e, group.x), vec4f(share, 1.0));
    }
}
