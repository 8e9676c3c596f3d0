//! How far a probe likely sees a surface point, by the mean and mean square of its distances (Majercik et al.,
//! "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", 2019).
#define_import_path lightgraph::visibility_moments
#import lightgraph::cube
#import lightgraph::octahedron
#import lightgraph::probes
#import lightgraph::surface::Surface

struct Test {
    probe_moments_tile: u32,
    probe_moments_columns: u32,
    /// Offset along the normal against self-shadowing, in distances between probes.
    probe_bias: f32,
}
var<uniform> test: Test;
/// Mean distance and mean squared distance, a tile a probe.
var probe_moments: texture_2d<f32>;

/// Edges of a cell, metres: the box's own along an axis of one probe, whose distances to others are without bounds.
fn cell_size() -> vec3f {
    return (probes::probe_grid.grid_max - probes::probe_grid.grid_min) / max(probes::span(), vec3f(1.0));
}

/// Distances above this count as this, metres: no point is gathered from farther away than a cell's diagonal.
fn reach() -> f32 {
    return 1.5 * length(cell_size());
}

/// A probe's moments in a direction, interpolated.
fn moments(probe: u32, d: vec3f) -> vec2f {
    let edge = test.probe_moments_tile;
    let at = (0.5 * octahedron::fold(d) + 0.5) * f32(edge) - 0.5;
    let low = vec2i(floor(at));
    let part = at - floor(at);
    var sum = vec2f(0.0);
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1u);
        let texel = octahedron::wrap(low + step, i32(edge));
        let share = select(1.0 - part, part, step == vec2i(1));
        let place = cube::unplace(probe, texel, edge, test.probe_moments_columns);
        sum += share.x * share.y * textureLoad(probe_moments, place, 0).rg;
    }
    return sum;
}

/// 0 to 1.2: Chebyshev's bound on the chance that the probe sees the point, cubed against leaks, times the wrapped
/// cosine between the normal and the direction to the probe, which falls smoothly behind the surface.
fn visibility(probe: vec3u, s: Surface) -> f32 {
    let spacing = cell_size();
    let eye = probes::position(probe);
    // A probe in the point itself is neither before nor behind the surface.
    let offset = eye - s.position;
    let facing = 0.5 * dot(offset, s.normal) * inverseSqrt(max(dot(offset, offset), 1e-12)) + 0.5;
    let moved = s.position + test.probe_bias * min(spacing.x, min(spacing.y, spacing.z)) * s.normal - eye;
    let far = length(moved);
    let m = moments(probes::number(probe), select(moved, s.normal, far == 0.0));
    let variance = abs(m.y - m.x * m.x);
    let beyond = max(far - m.x, 0.0);
    let chance = variance / max(variance + beyond * beyond, 1e-12);
    let seen = select(1.0, chance * chance * chance, beyond > 0.0);
    return seen * (facing * facing + 0.2);
}
