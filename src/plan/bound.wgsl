//! Built in: how much a pass does, of what a buffer says and no more than the pass allows.

var<storage, read> counts: array<u32>;
/// As WebGPU reads the arguments of an indirect dispatch or draw.
var<storage, read_write> arguments: array<u32>;

struct Bounds {
    /// Not 0: vertices and instances, and the first of each; else workgroups along three axes.
    draw: u32,
    most_x: u32,
    most_y: u32,
    most_z: u32,
    /// Not 0: a draw may begin at another instance than the first.
    offsets: u32,
}
var<uniform> bounds: Bounds;

@compute @workgroup_size(1)
fn bound() {
    if bounds.draw == 0u {
        arguments[0] = min(counts[0], bounds.most_x);
        arguments[1] = min(counts[1], bounds.most_y);
        arguments[2] = min(counts[2], bounds.most_z);
        return;
    }
    let first_vertex = min(counts[2], bounds.most_x);
    let first_instance = min(counts[3], bounds.most_y);
    let begins = bounds.offsets != 0u || first_instance == 0u;
    arguments[0] = min(counts[0], bounds.most_x - first_vertex);
    arguments[1] = select(0u, min(counts[1], bounds.most_y - first_instance), begins);
    arguments[2] = first_vertex;
    arguments[3] = select(0u, first_instance, begins);
}
