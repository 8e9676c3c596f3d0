//! How many paths show the same as the next batch and came before it: 0 after the camera, the scene, a parameter or a
//! shader changed. With WAITS there is no batch in a frame in which something changed.
#import lightgraph::progress::Progress
#import lightgraph::digest::add_matrix

struct View {
    camera_view_projection: mat4x4f,
    content_hash: u32,
    samples: u32,
    /// How many batches make a frame.
    batches: u32,
    /// The loop's index.
    batch: u32,
}
var<uniform> view: View;

var<storage, read_write> progress: Progress;
/// The same, for `lightgraph::rounds`.
var progress_texel: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(1)
fn main() {
    let content = add_matrix(view.content_hash, view.camera_view_projection);
    let same = progress.content == content;
    progress.paths = select(0u, progress.next, same);
    // The batches of a frame are alike to one path.
    progress.next = progress.paths + (view.samples + view.batch) / view.batches;
#ifdef WAITS
    progress.next = select(0u, progress.next, same);
#endif
    progress.round = select(0u, progress.round + 1u, same);
    progress.content = content;
    progress.frame = select(0u, progress.frame + 1u, progress.scene == view.content_hash);
    progress.scene = view.content_hash;
    textureStore(progress_texel, vec2u(0u), vec4u(progress.paths, progress.next, progress.round, progress.frame));
}
