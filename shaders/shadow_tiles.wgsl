//! Depths of the scene from the views of lights, a workgroup a tile of 16 × 16 texels: it finds the groups of triangles
//! that may cover it, then the triangles of some groups at a time. What may cover few of its texels a lane draws by
//! itself; of the others each lane draws its texel.
#import lightgraph::raster::{Planes, nearer, planes}
#import lightgraph::shadow_texels::{Covered, GROUP, params, seen}

var<storage, read> shadow_bounds: array<Covered>;
var<storage, read> shadow_groups: array<Covered>;
var<storage, read_write> shadow_texels: array<f32>;

const TILE: u32 = 16u;
/// As many as a tile has texels.
const LANES: u32 = 256u;
/// Groups whose triangles are looked at in one go.
const PART: u32 = 8u;
/// Texels that a lane draws by itself.
const FEW: u32 = 16u;
/// Triangles of which all lanes draw their texels in one go.
const BATCH: u32 = 32u;

/// Groups that may cover the tile and wait.
var<workgroup> groups_here: array<u32, PART + LANES>;
var<workgroup> group_count: atomic<u32>;
/// Triangles that cover few texels from the start on, the others from the end back.
var<workgroup> triangles_here: array<u32, 1024>;
var<workgroup> few_count: atomic<u32>;
var<workgroup> many_count: atomic<u32>;
var<workgroup> drawn: array<Planes, BATCH>;
/// Depths as the bits of numbers from 0 to 1, which keep their order.
var<workgroup> nearest: array<atomic<u32>, LANES>;

/// What a box has of the tile: the first texel (xy) and those past the last (zw), of the tile.
fn part(c: Covered, low: vec2u) -> vec4u {
    let first = vec2u(c.first & 0xffffu, c.first >> 16u);
    let end = vec2u(c.end & 0xffffu, c.end >> 16u);
    return vec4u(max(first, low) - low, max(min(end, low + TILE), low) - low);
}

@compute @workgroup_size(256)
fn draw(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) lane: u32) {
    let view = tile.z;
    let low = tile.xy * TILE;
    let groups = (params.triangles + GROUP - 1u) / GROUP;
    let mine = vec2u(lane % TILE, lane / TILE);
    var depth = 1.0;
    atomicStore(&nearest[lane], bitcast<u32>(1.0));
    var start = 0u;
    var count = 0u;
    loop {
        while count < PART && start < groups {
            let g = start + lane;
            if g < groups {
                let box = part(shadow_groups[view * groups + g], low);
                if all(box.xy < box.zw) {
                    groups_here[atomicAdd(&group_count, 1u)] = g;
                }
            }
            start += LANES;
            workgroupBarrier();
            count = atomicLoad(&group_count);
            workgroupBarrier();
        }
        if count == 0u {
            break;
        }
        let these = min(PART, count);
        count -= these;
        if lane == 0u {
            atomicStore(&group_count, count);
            atomicStore(&few_count, 0u);
            atomicStore(&many_count, 0u);
        }
        workgroupBarrier();
        for (var i = lane; i < these * GROUP; i += LANES) {
            let triangle = groups_here[count + i / GROUP] * GROUP + i % GROUP;
            let box = part(shadow_bounds[view * groups * GROUP + triangle], low);
            if all(box.xy < box.zw) {
                let extent = box.zw - box.xy;
                if extent.x * extent.y <= FEW {
                    triangles_here[atomicAdd(&few_count, 1u)] = triangle;
                } else {
                    triangles_here[PART * GROUP - 1u - atomicAdd(&many_count, 1u)] = triangle;
                }
            }
        }
        workgroupBarrier();
        let few = atomicLoad(&few_count);
        for (var i = lane; i < few; i += LANES) {
            let triangle = triangles_here[i];
            let box = part(shadow_bounds[view * groups * GROUP + triangle], low);
            let p = planes(seen(triangle, view, low));
            for (var y = box.y; y < box.w; y++) {
                for (var x = box.x; x < box.z; x++) {
                    let d = nearer(1.0, p, vec2f(vec2u(x, y)) + 0.5);
                    if d < 1.0 {
                        atomicMin(&nearest[y * TILE + x], bitcast<u32>(d));
                    }
                }
            }
        }
        let many = atomicLoad(&many_count);
        for (var next = 0u; next < many; next += BATCH) {
            let batch = min(BATCH, many - next);
            if lane < batch {
                drawn[lane] = planes(seen(triangles_here[PART * GROUP - 1u - next - lane], view, low));
            }
            workgroupBarrier();
            for (var i = 0u; i < batch; i++) {
                depth = nearer(depth, drawn[i], vec2f(mine) + 0.5);
            }
            workgroupBarrier();
        }
        workgroupBarrier();
    }
    let at = low + mine;
    if all(at < vec2u(params.shadow_size)) {
        let texel = (view * params.shadow_size + at.y) * params.shadow_size + at.x;
        shadow_texels[texel] = min(depth, bitcast<f32>(atomicLoad(&nearest[lane])));
    }
}
