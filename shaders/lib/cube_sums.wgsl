//! Sums over the texels of a cube of light times harmonics and solid angles, in registers: four coefficients to a
//! matrix, without loops or arrays. What `lightgraph::projection` does to the shares of each texel is left to do to the
//! sums.
#define_import_path lightgraph::cube_sums
#import lightgraph::cube
#import lightgraph::sh::{COUNT, basis}

/// Light times each coefficient's factor, a column each.
struct Sums {
#if SH_ORDER >= 1
    m0: mat4x3f,
#endif
#if SH_ORDER >= 2
    m1: mat4x3f,
#endif
#if SH_ORDER >= 3
    m2: mat4x3f,
    m3: mat4x3f,
#endif
#if SH_ORDER >= 4
    m4: mat4x3f,
    m5: mat4x3f,
#endif
#if SH_ORDER != 1
#if SH_ORDER != 3
    last: vec3f,
#endif
#endif
}

fn outer(light: vec3f, factors: vec4f) -> mat4x3f {
    return mat4x3f(light * factors.x, light * factors.y, light * factors.z, light * factors.w);
}

/// The sums with a texel more. `ray` and `area`: its direction and its solid angle.
fn with_texel(sums: Sums, light: vec3f, ray: vec3f, area: f32, face: u32, texel: vec2u, edge: u32) -> Sums {
    let y = basis(ray);
    let l = light * area;
    var s = sums;
#if SH_ORDER == 0
    s.last += l * y[0];
#else
    s.m0 += outer(l, vec4f(y[0], y[1], y[2], y[3]));
#endif
#if SH_ORDER >= 2
    s.m1 += outer(l, vec4f(y[4], y[5], y[6], y[7]));
#endif
#if SH_ORDER == 2
    s.last += l * y[8];
#endif
#if SH_ORDER >= 3
    s.m2 += outer(l, vec4f(y[8], y[9], y[10], y[11]));
    s.m3 += outer(l, vec4f(y[12], y[13], y[14], y[15]));
#endif
#if SH_ORDER >= 4
#ifdef LEAST_SQUARES
    s.m4 += outer(l, vec4f(y[16], y[17], y[18], y[19]));
    s.m5 += outer(l, vec4f(y[20], y[21], y[22], y[23]));
    s.last += l * y[24];
#else
    // A finer sum within the texel, as the factor textures have it.
    for (var i = 0u; i < 16u; i++) {
        let part = texel * 4u + vec2u(i % 4u, i / 4u);
        let z = basis(cube::direction(face, part, edge * 4u));
        let fine = light * cube::solid_angle(part, edge * 4u);
        s.m4 += outer(fine, vec4f(z[16], z[17], z[18], z[19]));
        s.m5 += outer(fine, vec4f(z[20], z[21], z[22], z[23]));
        s.last += fine * z[24];
    }
#endif
#endif
    return s;
}
