// A digest of each of some tiles of an atlas: 128 bits, a sum over its texels of what each is mixed to with its place. `bits(at)`
// stands above, by the kind of texels.

// Texels along a tile, tiles in a row, then the tiles.
@group(0) @binding(1) var<storage, read> asked: array<u32>;
// Four words a tile, 0 before.
@group(0) @binding(2) var<storage, read_write> digests: array<atomic<u32>>;

const LANES: u32 = 16u;

// pcg4d of Jarzynski and Olano, "Hash Functions for GPU Rendering" (JCGT 2020).
fn mixed(words: vec4u) -> vec4u {
    var v = words * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4u(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

@compute @workgroup_size(LANES)
fn digest(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = group.y * groups.x + group.x;
    if i + 2u >= arrayLength(&asked) {
        return;
    }
    let edge = asked[0];
    let tile = asked[i + 2u];
    let corner = vec2u(tile % asked[1], tile / asked[1]) * edge;
    var sum = vec4u(0u);
    for (var at = lane; at < edge * edge; at += LANES) {
        // The place goes through the mixing too, so that texels which change places don't come out the same.
        sum += mixed(bits(corner + vec2u(at % edge, at / edge)) ^ mixed(vec4u(at, 1u, 2u, 3u)));
    }
    for (var k = 0u; k < 4u; k++) {
        atomicAdd(&digests[4u * i + k], sum[k]);
    }
}
