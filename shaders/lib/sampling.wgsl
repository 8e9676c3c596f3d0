//! Directions and points from numbers in the unit square.
#define_import_path lightgraph::sampling

/// Two unit vectors that make a right-handed frame with a unit vector (Duff et al., "Building an Orthonormal Basis,
/// Revisited", 2017), times components.
fn in_frame(axis: vec3f, v: vec3f) -> vec3f {
    let sign = select(-1.0, 1.0, axis.z >= 0.0);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let tangent = vec3f(1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    let bitangent = vec3f(b, sign + axis.y * axis.y * a, -axis.y);
    return normalize(v.x * tangent + v.y * bitangent + v.z * axis);
}

/// Unit square to unit disc with equal areas, and squares to compact cells (Shirley and Chiu, "A Low Distortion Map
/// Between Disk and Square", 1997).
fn disc(u: vec2f) -> vec2f {
    let p = 2.0 * u - 1.0;
    if all(p == vec2f(0.0)) {
        return vec2f(0.0);
    }
    let wide = abs(p.x) > abs(p.y);
    let radius = select(p.y, p.x, wide);
    let angle = 0.785398163397 * select(2.0 - p.x / p.y, p.y / p.x, wide);
    return radius * vec2f(cos(angle), sin(angle));
}

/// A direction with the density cos/pi round a unit normal.
fn cosine_direction(normal: vec3f, u: vec2f) -> vec3f {
    let p = disc(u);
    return in_frame(normal, vec3f(p, sqrt(max(1.0 - dot(p, p), 1e-7))));
}

/// A direction with the density (n + 1)/(2 pi) cos^n round a unit axis.
fn lobe_direction(axis: vec3f, n: f32, u: vec2f) -> vec3f {
    let cosine = pow(1.0 - u.x, 1.0 / (n + 1.0));
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    let angle = 6.28318530718 * u.y;
    return in_frame(axis, vec3f(sine * cos(angle), sine * sin(angle), cosine));
}

/// Barycentric coordinates of the second and third corner, uniform over a triangle (Heitz, "A Low-Distortion Map
/// Between Triangle and Square", 2019).
fn triangle(u: vec2f) -> vec2f {
    let half = 0.5 * u;
    if u.y > u.x {
        return vec2f(half.x, u.y - half.x);
    }
    return vec2f(u.x - half.y, half.y);
}
