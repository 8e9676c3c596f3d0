//! Hashes of values, to notice that they changed.
#define_import_path lightgraph::digest
#import lightgraph::random::scramble

fn add(hash: u32, v: vec3f) -> u32 {
    let words = bitcast<vec3u>(v);
    return scramble(words.x + scramble(words.y + scramble(words.z + hash)));
}

fn add_matrix(hash: u32, m: mat4x4f) -> u32 {
    var h = hash;
    for (var i = 0u; i < 4u; i++) {
        h = scramble(bitcast<u32>(m[i].w) + add(h, m[i].xyz));
    }
    return h;
}
