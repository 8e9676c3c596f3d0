//! Looks at the places that light comes from: one of a run of them, chosen by what it gives.
#define_import_path lightgraph::sources
#import lightgraph::photons::{Count, Source, promised}
#import lightgraph::random::next
#import lightgraph::source_texels::source_at
#import lightgraph::trace::is_free

/// Uniform: shaders that trace rays have room for no storage buffer more.
var<uniform> source_count: array<Count, 1>;

/// Rays end this share before a source, which would be in its own way.
const REACH: f32 = 0.999;

/// Whether rays from `start` see a source.
fn sees(start: vec3f, source: Source) -> bool {
    let way = source.position - start;
    let end = length(way);
    return is_free(start, way / max(end, 1e-20), REACH * end);
}

/// Sources that one is chosen from.
const CANDIDATES: u32 = #{CANDIDATES}u;

struct Choice {
    row: u32,
    /// One over how likely it was chosen, as if there were one source.
    weight: f32,
}

/// One of a run of sources, by what it gives the point unshadowed (Talbot, Cline and Egbert, "Importance Resampling for
/// Global Illumination", 2005).
fn choose(position: vec3f, normal: vec3f, first: u32, chance: u32) -> Choice {
    var state = chance;
    var chosen = Choice();
    var total = 0.0;
    var own = 0.0;
    for (var i = 0u; i < CANDIDATES; i++) {
        let row = (first + i) % source_count[0].count;
        let promise = promised(source_at(row), position, normal);
        total += promise;
        if next(&state) * total < promise {
            chosen.row = row;
            own = promise;
        }
    }
    chosen.weight = select(0.0, total / (own * f32(CANDIDATES)), own > 0.0);
    return chosen;
}
