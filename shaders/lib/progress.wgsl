//! How far the mean of the frames that show the same has come. progress.wgsl counts.
#define_import_path lightgraph::progress

struct Progress {
    /// Paths before this batch, and with it.
    paths: u32,
    next: u32,
    /// A hash of all that the image depends on.
    content: u32,
    /// Frames before this one that show the same.
    round: u32,
    /// A hash of all that but the camera.
    scene: u32,
    /// Frames before this one in which only the camera moved, if anything.
    frame: u32,
}
