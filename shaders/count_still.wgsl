//! How many frames before this one show the same, for `lightgraph::rounds`.
struct Progress {
    paths: u32,
    next: u32,
    content: u32,
    round: u32,
}
var<storage, read> progress: Progress;

@fragment
fn count_still() -> @location(0) vec4u {
    return vec4u(progress.round);
}
