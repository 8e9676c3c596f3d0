//! How many points on emitters a cell's ray looks at, of which light that a ray meets by chance takes account.
#define_import_path lightgraph::looks
#import lightgraph::emitters::emitters

var<uniform> cell_samples: u32;

/// Points that one is chosen from at most, and the emitters that make one of them worth its time.
const CANDIDATES: u32 = 4u;
const EMITTERS_EACH: u32 = 64u;

/// Points that one is chosen from.
fn points_each() -> u32 {
    return clamp(arrayLength(&emitters) / EMITTERS_EACH, 1u, CANDIDATES);
}
