//! Real orthonormal spherical harmonics up to l = SH_ORDER (0 to 10).
//!
//! Order (l, m) = (0,0) (1,-1) (1,0) (1,1) (2,-2) and so on, without the Condon-Shortley sign. The constants are
//! sqrt((2l + 1)/(4 pi) * (l - |m|)!/(l + |m|)!), times sqrt(2) for m != 0, multiplied out up to l = 4; from
//! there on recurrences make them.
#define_import_path lightgraph::sh

/// Highest degree.
const ORDER: u32 = #{SH_ORDER}u;
/// Number of coefficients.
const COUNT: u32 = (ORDER + 1u) * (ORDER + 1u);

/// Every basis function in the unit direction `d`.
fn basis(d: vec3f) -> array<f32, COUNT> {
    var y: array<f32, COUNT>;
    y[0] = 0.28209479177;
#if SH_ORDER >= 1
    y[1] = 0.48860251190 * d.y;
    y[2] = 0.48860251190 * d.z;
    y[3] = 0.48860251190 * d.x;
#endif
#if SH_ORDER >= 2
    let s = d * d;
    y[4] = 1.09254843059 * d.x * d.y;
    y[5] = 1.09254843059 * d.y * d.z;
    y[6] = 0.31539156525 * (3.0 * s.z - 1.0);
    y[7] = 1.09254843059 * d.x * d.z;
    y[8] = 0.54627421530 * (s.x - s.y);
#endif
#if SH_ORDER >= 3
    y[9] = 0.59004358993 * d.y * (3.0 * s.x - s.y);
    y[10] = 2.89061144264 * d.x * d.y * d.z;
    y[11] = 0.45704579946 * d.y * (5.0 * s.z - 1.0);
    y[12] = 0.37317633259 * d.z * (5.0 * s.z - 3.0);
    y[13] = 0.45704579946 * d.x * (5.0 * s.z - 1.0);
    y[14] = 1.44530572132 * d.z * (s.x - s.y);
    y[15] = 0.59004358993 * d.x * (s.x - 3.0 * s.y);
#endif
#if SH_ORDER >= 4
    y[16] = 2.50334294180 * d.x * d.y * (s.x - s.y);
    y[17] = 1.77013076978 * d.y * d.z * (3.0 * s.x - s.y);
    y[18] = 0.94617469576 * d.x * d.y * (7.0 * s.z - 1.0);
    y[19] = 0.66904654355 * d.y * d.z * (7.0 * s.z - 3.0);
    y[20] = 0.10578554692 * (35.0 * s.z * s.z - 30.0 * s.z + 3.0);
    y[21] = 0.66904654355 * d.x * d.z * (7.0 * s.z - 3.0);
    y[22] = 0.47308734788 * (s.x - s.y) * (7.0 * s.z - 1.0);
    y[23] = 1.77013076978 * d.x * d.z * (s.x - 3.0 * s.y);
    y[24] = 0.62583573545 * (s.x * (s.x - 3.0 * s.y) - s.y * (3.0 * s.x - s.y));
#endif
#if SH_ORDER >= 5
    // For each m: p is the normalised Legendre function over sin^m, upwards in l (Press et al., "Numerical Recipes",
    // 3rd edition, section 6.7); (x + iy)^m holds sin^m and the angle round z.
    var turn = vec2f(1.0, 0.0);
    var start = 0.28209479177;
    for (var m = 0u; m <= ORDER; m++) {
        let q = f32(m);
        if m > 0u {
            turn = vec2f(turn.x * d.x - turn.y * d.y, turn.x * d.y + turn.y * d.x);
            start *= sqrt((2.0 * q + 1.0) / (2.0 * q));
        }
        var low = 0.0;
        var p = start;
        for (var l = m; l <= ORDER; l++) {
            let degree = f32(l);
            if l > m {
                let here = (4.0 * degree * degree - 1.0) / (degree * degree - q * q);
                let back = ((degree - 1.0) * (degree - 1.0) - q * q) / (4.0 * (degree - 1.0) * (degree - 1.0) - 1.0);
                let next = sqrt(here) * (d.z * p - sqrt(max(back, 0.0)) * low);
                low = p;
                p = next;
            }
            if l >= 5u {
                let middle = l * (l + 1u);
                y[middle] = select(y[middle], p, m == 0u);
                if m > 0u {
                    y[middle + m] = 1.41421356237 * p * turn.x;
                    y[middle - m] = 1.41421356237 * p * turn.y;
                }
            }
        }
    }
#endif
    return y;
}

/// Basis function number `index` in the unit direction `d`; 0 past the last.
fn term(index: u32, d: vec3f) -> f32 {
    var y = basis(d);
    return select(0.0, y[min(index, COUNT - 1u)], index < COUNT);
}

/// Basis function number k of degree l, from 0 to 2l, in the unit direction `d`: the same by itself, with no array.
fn harmonic(l: u32, k: u32, d: vec3f) -> f32 {
    let m = max(k, l) - min(k, l);
    let q = f32(m);
    var turn = vec2f(select(1.41421356237, 1.0, m == 0u), 0.0);
    var p = 0.28209479177;
    for (var i = 1u; i <= m; i++) {
        turn = vec2f(turn.x * d.x - turn.y * d.y, turn.x * d.y + turn.y * d.x);
        p *= sqrt(f32(2u * i + 1u) / f32(2u * i));
    }
    var low = 0.0;
    for (var i = m + 1u; i <= l; i++) {
        let degree = f32(i);
        let here = (4.0 * degree * degree - 1.0) / (degree * degree - q * q);
        let back = ((degree - 1.0) * (degree - 1.0) - q * q) / (4.0 * (degree - 1.0) * (degree - 1.0) - 1.0);
        let next = sqrt(here) * (d.z * p - sqrt(max(back, 0.0)) * low);
        low = p;
        p = next;
    }
    return p * select(turn.x, turn.y, k < l);
}
