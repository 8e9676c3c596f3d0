//! Where the planes of a non-uniform grid stand: along each axis at even steps of a distribution, a mixture of the
//! box's length and of the surfaces that the axis runs along: their area, and with PROBE_TABLE_SEEN, along the view of
//! a long box, how much of the image they fill.
//!
//! A surface counts with the sine between its normal and the axis: a wall across the axis says nothing of how light
//! varies along it.
#ifdef PROBE_TABLE_SEEN
#import lightgraph::camera::pixel_ray
#import lightgraph::seen::{seen_at, surface_albedo}
#import lightgraph::surface::is_lit
#endif

/// Area of surfaces in each part of the box along each axis, as axis_areas.wgsl finds it piece by piece.
var<storage, read> axis_areas: array<f32>;

struct Params {
    grid: vec3u,
    grid_min: vec3f,
    grid_max: vec3f,
    /// Distance of the outer probes from the box, in mean distances between probes.
    inset: f32,
    /// Share of the surfaces in the distribution, 0 to 1.
    crowding: f32,
#ifdef PROBE_TABLE_SEEN
    /// Share of the image in that of the surfaces along a long axis that the camera looks along, 0 to 1.
    seen: f32,
    /// How long the box is along each axis, up to 1; not long at all below 0.
    long: vec3f,
    camera_view: mat4x4f,
#endif
}
var<uniform> params: Params;
/// As `lightgraph::probes` has them.
var<storage, read_write> probe_axes: array<vec4f>;

const BINS: u32 = 64u;
const LANES: u32 = 64u;
/// Area of surfaces in each part of the box along the axis, square metres.
var<workgroup> area: array<f32, BINS>;
/// Pixels in each part, in 1/256: integers, whose sum does not depend on the order.
var<workgroup> pixels: array<atomic<u32>, BINS>;
/// More than this many pixels along a side of the image are not looked at one by one.
const SIDE: u32 = 128u;

/// One workgroup an axis, one lane a bin.
@compute @workgroup_size(LANES)
fn axes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let axis = group.x;
    let low = params.grid_min[axis];
    let width = (params.grid_max[axis] - low) / f32(BINS);
    var sum = 0.0;
    for (var i = axis * BINS + lane; i < arrayLength(&axis_areas); i += 3u * BINS) {
        sum += axis_areas[i];
    }
    area[lane] = sum;
    atomicStore(&pixels[lane], 0u);
    workgroupBarrier();
#ifdef PROBE_TABLE_SEEN
    let size = textureDimensions(surface_albedo);
    let steps = (size + SIDE - 1u) / SIDE;
    let looks = size / steps;
    for (var i = lane; i < looks.x * looks.y; i += LANES) {
        let pixel = vec2u(i % looks.x, i / looks.x) * steps;
        let surface = seen_at(pixel);
        if is_lit(surface.albedo) {
            let ray = pixel_ray(pixel);
            let at = (ray.origin[axis] + surface.normal.w * ray.direction[axis] - low) / width;
            let bin = u32(clamp(at, 0.0, f32(BINS) - 1.0));
            let along = sqrt(max(1.0 - surface.normal[axis] * surface.normal[axis], 0.0));
            atomicAdd(&pixels[bin], u32(256.0 * along));
        }
    }
#endif
    workgroupBarrier();
    if lane != 0u {
        return;
    }
    var total = vec2f(0.0);
    for (var bin = 0u; bin < BINS; bin++) {
        total += vec2f(area[bin], f32(atomicLoad(&pixels[bin])));
    }
    let count = params.grid[axis];
    let first = select(0u, params.grid.x, axis > 0u) + select(0u, params.grid.y, axis > 1u);
    var seen = 0.0;
#ifdef PROBE_TABLE_SEEN
    // The square of the cosine between the axis and the view: over the three axes it sums to 1.
    let along = params.camera_view[axis].z * params.camera_view[axis].z;
    seen = params.seen * along * max(params.long[axis], 0.0);
#endif
    var bin = 0u;
    // The distribution below the bin.
    var below = 0.0;
    var before = 0.0;
    for (var i = 0u; i < count; i++) {
        let steps = max(f32(count - 1u) + 2.0 * params.inset, 1e-20);
        let share = select((f32(i) + params.inset) / steps, 0.5, count == 1u);
        var here = density(bin, total, seen);
        while bin + 1u < BINS && below + here < share {
            below += here;
            bin += 1u;
            here = density(bin, total, seen);
        }
        let plane = low + (f32(bin) + clamp((share - below) / max(here, 1e-12), 0.0, 1.0)) * width;
        if i > 0u {
            probe_axes[first + i - 1u] = vec4f(before, 1.0 / max(plane - before, 1e-20), 0.0, 0.0);
        }
        before = plane;
    }
    probe_axes[first + count - 1u] = vec4f(before, 0.0, 0.0, 0.0);
}

/// Share of the distribution in a bin; all bins sum to 1. `total`: of areas and of pixels. `seen`: the share of the
/// pixels.
fn density(bin: u32, total: vec2f, seen: f32) -> f32 {
    let even = 1.0 / f32(BINS);
    let parts = vec2f(area[bin], f32(atomicLoad(&pixels[bin]))) / max(total, vec2f(1e-20));
    let surfaces = select(vec2f(even), parts, total > vec2f(0.0));
    return mix(even, mix(surfaces.x, surfaces.y, seen), params.crowding);
}
