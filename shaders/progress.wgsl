//! How many paths show the same as the next batch and came before it: 0 after the camera, the scene or a parameter
//! changed. With WAITS there is no batch in a frame in which something changed.
#import lightgraph::progress::Progress
#import lightgraph::digest::{add, add_matrix}
#import lightgraph::random::scramble
#import lightgraph::geometry::{node_count, nodes}
#import lightgraph::surface::materials
#ifdef LIGHTS
#import lightgraph::lights::{light_count, lights}
#endif

struct View {
    camera_view_projection: mat4x4f,
    screen: vec2u,
    samples: u32,
    bounces: u32,
    seed: u32,
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
    var hash = 1u;
    for (var i = 0u; i < node_count(); i++) {
        hash = add_matrix(hash, nodes[i].transform);
    }
#ifdef LIGHTS
    for (var i = 0u; i < light_count(); i++) {
        hash = add(add(add(hash, lights[i].position), lights[i].direction), lights[i].intensity);
    }
#endif
    for (var i = 0u; i < arrayLength(&materials); i++) {
        let m = materials[i];
        hash = add(add(add(hash, m.base_color.rgb), m.emission), vec3f(m.specular, m.shininess, 0.0));
#ifdef GGX
        hash = add(hash, vec3f(m.roughness, m.metallic, 0.0));
#endif
    }
    hash = scramble(view.screen.x + scramble(view.screen.y + hash));
    hash = scramble(view.samples + scramble(view.bounces + scramble(view.seed + hash)));
    // 0 is what memory holds before the first frame.
    let scene = max(hash, 1u);
    let content = max(add_matrix(hash, view.camera_view_projection), 1u);
    let same = progress.content == content;
    progress.paths = select(0u, progress.next, same);
    // The batches of a frame are alike to one path.
    progress.next = progress.paths + (view.samples + view.batch) / view.batches;
#ifdef WAITS
    progress.next = select(0u, progress.next, same);
#endif
    progress.round = select(0u, progress.round + 1u, same);
    progress.content = content;
    progress.frame = select(0u, progress.frame + 1u, progress.scene == scene);
    progress.scene = scene;
    textureStore(progress_texel, vec2u(0u), vec4u(progress.paths, progress.next, progress.round, progress.frame));
}
