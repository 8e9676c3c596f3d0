//! Which probes the surfaces that a probe sees take light from: a row of REACH_WORDS words a probe, of whose bits each
//! stands for as many probes in a row as it takes. A workgroup a probe finds them; that may be more than there are: of
//! a block of 4x4 texels all from the lowest to the highest.
#import lightgraph::cube
#import lightgraph::instances
#import lightgraph::packed_surface::surface_at
#import lightgraph::probes
#import lightgraph::surface::is_lit

const WORDS: u32 = #{REACH_WORDS}u;
const LANES: u32 = 32u;
/// Texels along an edge of a block.
const BLOCK: u32 = 4u;
/// Probes to a bit.
const RUN: u32 = #{REACH_RUN}u;
/// What a place in the grid may be off by, for its rounding.
const MARGIN: f32 = 1e-3;

struct Params {
    grid: vec3u,
    cube_surface_tile: u32,
    cube_surface_columns: u32,
}
var<uniform> params: Params;
var<storage, read_write> reach: array<u32>;

var<workgroup> row: array<atomic<u32>, WORDS>;

@compute @workgroup_size(LANES)
fn probe_reach(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let probe = instances::number(group);
    if lane < WORDS {
        atomicStore(&row[lane], 0u);
    }
    workgroupBarrier();
    let edge = params.cube_surface_tile;
    let along = (edge + BLOCK - 1u) / BLOCK;
    let eye = probes::position(probes::coordinates(probe));
    for (var block = lane; block < 6u * along * along; block += LANES) {
        let face = block / (along * along);
        let first = BLOCK * vec2u(block % along, block / along % along);
        let corner = cube::corner(probe * 6u + face, edge, params.cube_surface_columns);
        var low = vec3f(1e30);
        var high = vec3f(-1e30);
        for (var i = 0u; i < BLOCK * BLOCK; i++) {
            let texel = min(first + vec2u(i % BLOCK, i / BLOCK), vec2u(edge - 1u));
            let r = surface_at(corner + texel);
            let at = probes::grid_place(eye + r.normal.w * cube::outward(face, cube::within_beside(texel, edge)));
            let lit = is_lit(r.albedo);
            low = min(low, select(vec3f(1e30), at, lit));
            high = max(high, select(vec3f(-1e30), at, lit));
        }
        if low.x <= high.x {
            mark(low, high);
        }
    }
    workgroupBarrier();
    if lane < WORDS {
        reach[probe * WORDS + lane] = atomicLoad(&row[lane]);
    }
}

/// Sets the bits of the probes round places in the grid from `low` to `high`.
fn mark(low: vec3f, high: vec3f) {
    let grid = params.grid;
    var a = vec3i(floor(low - MARGIN));
    var b = vec3i(floor(high + MARGIN)) + 1;
#ifdef PROBE_VISIBILITY
    // Of those beyond a cell's corners too.
    a -= 1;
    b += 1;
#endif
    let last = vec3i(grid) - 1;
    let lower = vec3u(clamp(a, vec3i(0), last));
    let upper = vec3u(clamp(b, vec3i(0), last));
    // Row by row along x.
    var y = lower.y;
    var z = lower.z;
    while z <= upper.z {
        let first = ((z * grid.y + y) * grid.x + lower.x) / RUN;
        let end = ((z * grid.y + y) * grid.x + upper.x) / RUN;
        for (var word = first / 32u; word <= end / 32u; word++) {
            let lowest = max(first, 32u * word) % 32u;
            let highest = min(end, 32u * word + 31u) % 32u;
            atomicOr(&row[word], (0xffffffffu << lowest) & (0xffffffffu >> (31u - highest)));
        }
        z += select(0u, 1u, y == upper.y);
        y = select(y + 1u, lower.y, y == upper.y);
    }
}
