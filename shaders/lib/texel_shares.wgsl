//! The share of each of the eight probes round what a texel of a probe's cube shows.
#define_import_path lightgraph::texel_shares

struct Shares {
    /// The lowest of the eight.
    base: vec3u,
    /// 0 for what sends no light: nothing, or a back.
    lit: u32,
    /// Of those on the near side along z, then of those on the far side: x fastest. They sum to 1.
    corners: array<vec4f, 2>,
}
