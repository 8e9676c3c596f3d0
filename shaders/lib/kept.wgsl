//! What each cell keeps: its key, then the rows of KEPT rays that met it.
#define_import_path lightgraph::kept
#import lightgraph::cells::PLACES
#import lightgraph::random::{even_pair, scramble}
#import lightgraph::rays::{Ray, unpack}
#import lightgraph::rounds::frame
#import lightgraph::sampling::cosine_direction

const KEPT: u32 = #{KEPT}u;
/// Rays that leave a cell.
const LINKS: u32 = #{LINKS}u;
/// Words of a cell.
const WORDS: u32 = KEPT + 1u;
/// Stands where there is no cell.
const NO_KEY: u32 = 0xffffffffu;

var<storage, read> kept: array<u32>;
/// Rays that met cells.
var<storage, read> met_by: array<vec4u>;

/// The key of a cell; NO_KEY beyond the last one.
fn key_of_cell(cell: u32) -> u32 {
    return select(NO_KEY, kept[min(cell, PLACES - 1u) * WORDS], cell < PLACES);
}

/// The texel of a link in `link_texels`, where LINKS of the first cell come first.
fn link_place(link: u32) -> vec2u {
    return vec2u(link % 2048u, link / 2048u);
}

/// Where a link leaves its cell: the end of one of the rays that the cell keeps, in turn.
fn leaves(cell: u32, link: u32) -> Ray {
    let row = kept[cell * WORDS + 1u + link % KEPT] & 0x3fffffu;
    return unpack(met_by[2u * row], met_by[2u * row + 1u]);
}

/// Where it goes: a cell's rays follow from its key.
fn link_direction(here: Ray, key: u32, link: u32) -> vec3f {
    return cosine_direction(here.normal, even_pair(frame() * LINKS + link, scramble(key)));
}
