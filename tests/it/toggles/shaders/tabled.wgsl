var rows: texture_2d<u32>;
var<storage, read_write> tabled: array<u32>;

@compute @workgroup_size(4) fn words(@builtin(local_invocation_index) i: u32) {
    let texel = textureLoad(rows, vec2u(i, 0u), 0);
    tabled[i] = texel.x ^ (texel.y >> 3u) ^ (texel.z >> 7u);
}
