//! Directions on an unfolded octahedron (Meyer et al., "On Floating-Point Normal Vectors", 2010), texels and their
//! neighbours across its edges.
#define_import_path lightgraph::octahedron

fn sign_of(v: vec2f) -> vec2f {
    return select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

/// Unit direction of a point of -1..1 squared.
fn unfold(at: vec2f) -> vec3f {
    let z = 1.0 - abs(at.x) - abs(at.y);
    let outer = (1.0 - abs(at.yx)) * sign_of(at);
    return normalize(vec3f(select(at, outer, z < 0.0), z));
}

/// Point of -1..1 squared that a direction of any length but 0 meets.
fn fold(d: vec3f) -> vec2f {
    let at = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    return select(at, (1.0 - abs(at.yx)) * sign_of(at), d.z < 0.0);
}

/// Unit direction through the centre of a texel of a map of `edge`² texels.
fn direction(texel: vec2u, edge: u32) -> vec3f {
    return unfold((2.0 * vec2f(texel) + 1.0) / f32(edge) - 1.0);
}

/// The texel that stands at `texel`, which may lie one step outside: each edge is folded on its own middle.
fn wrap(texel: vec2i, edge: i32) -> vec2u {
    var t = texel;
    if t.x < 0 || t.x >= edge {
        t = vec2i(clamp(t.x, 0, edge - 1), edge - 1 - t.y);
    }
    if t.y < 0 || t.y >= edge {
        t = vec2i(edge - 1 - t.x, clamp(t.y, 0, edge - 1));
    }
    return vec2u(t);
}
