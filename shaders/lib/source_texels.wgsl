//! Sources in a texture, some texels each: drivers without caches of their own fetch four numbers of a texture in the
//! time that one of a buffer takes.
#define_import_path lightgraph::source_texels
#import lightgraph::photons::{Source, TEXELS, unpack_source}

/// Sources in a row of texels.
const SOURCES_A_ROW: u32 = 128u;
var source_texels: texture_storage_2d<rgba32uint, read>;

fn source_at(row: u32) -> Source {
    let place = vec2u(TEXELS * (row % SOURCES_A_ROW), row / SOURCES_A_ROW);
    let a = textureLoad(source_texels, place);
    let b = textureLoad(source_texels, place + vec2u(1u, 0u));
#ifdef GGX
    return unpack_source(a, b, textureLoad(source_texels, place + vec2u(2u, 0u)));
#else
    return unpack_source(a, b);
#endif
}
