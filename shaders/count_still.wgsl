//! How many frames before this one show the same, for `lightgraph::rounds`.
#import lightgraph::progress::Progress

var<storage, read> progress: Progress;

@fragment
fn count_still() -> @location(0) vec4u {
    return vec4u(progress.round);
}
