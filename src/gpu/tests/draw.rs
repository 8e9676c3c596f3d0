use crate::gpu::testing::{Sketch, gpu, quads, run, run_scene};
use crate::gpu::{FrameInputs, execute, prepare, read_image};
use crate::plan::{Cull, DrawGeometry, Place, ResourceId, TextureKind};
use crate::scene::{self, TextureArray};
use wgpu::TextureFormat as F;

const SOLID: &str = "
struct Varying { @builtin(position) at: vec4f, @location(0) @interpolate(flat) id: vec2u }
@vertex fn vertex(
    @location(0) material: u32, @location(1) position: vec3f, @builtin(instance_index) member: u32
) -> Varying {
    return Varying(vec4f(position, 1.0), vec2u(material + 1u, member));
}
@fragment fn fragment(v: Varying) -> @location(0) vec4f {
    return vec4f(vec2f(v.id), v.at.z, 1.0);
}";

/// Red (material + 1) and green (member) of a texel.
fn ids(image: &crate::image::Image, x: u32, y: u32, layer: u32) -> (f32, f32) {
    let at = (((layer * image.height + y) * image.width + x) * image.channels) as usize;
    (image.data[at], image.data[at + 1])
}

#[test]
fn the_screen_pass_covers_every_texel_with_row_0_on_top() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 7, 5);
    let gradient = s.screen(
        "gradient",
        "@fragment fn main(@builtin(position) p: vec4f) -> @location(0) vec4f { return vec4f(p.xy, 0.0, 1.0); }",
        "image",
    );
    let image = run(s.order([gradient])).image("image");
    for y in 0..5 {
        for x in 0..7 {
            assert_eq!(ids(&image, x, y, 0), (x as f32 + 0.5, y as f32 + 0.5));
        }
    }
}

#[test]
fn materials_decide_what_is_culled_and_depth_what_is_seen() {
    for (cull, left, right) in
        [(Cull::Material, 1.0, 2.0), (Cull::None, 1.0, 2.0), (Cull::Back, 1.0, 0.0), (Cull::Front, 2.0, 2.0)]
    {
        let mut s = Sketch::new();
        s.image("image", F::Rgba32Float, 4, 4);
        s.image("depth", F::Depth32Float, 4, 4);
        let targets = (["image"].as_slice(), Some("depth"));
        let draw = s.draw("draw", SOLID, DrawGeometry::Scene { cull }, targets, &[Place::Whole]);
        let ran = run_scene(s.order([draw]), &quads(), &[]);
        let image = ran.image("image");
        assert_eq!((ids(&image, 0, 1, 0).0, ids(&image, 3, 1, 0).0), (left, right), "{cull:?}");
        if cull == Cull::Material {
            assert_eq!(ran.image("depth").data[..4], [0.5, 0.5, 0.75, 0.75]);
        }
    }
}

#[test]
fn members_draw_into_their_tiles() {
    let mut s = Sketch::new();
    s.image("atlas", F::Rgba32Float, 8, 8);
    s.image("depth", F::Depth32Float, 8, 8);
    let places = [Place::Rect([0, 0, 4, 4]), Place::Rect([4, 0, 4, 4]), Place::Rect([0, 4, 4, 4])];
    let targets = (["atlas"].as_slice(), Some("depth"));
    let draw = s.draw("draw", SOLID, DrawGeometry::Scene { cull: Cull::Material }, targets, &places);
    let image = run_scene(s.order([draw]), &quads(), &[]).image("atlas");
    assert_eq!([ids(&image, 1, 0, 0), ids(&image, 2, 0, 0)], [(1.0, 0.0), (2.0, 0.0)]);
    assert_eq!([ids(&image, 5, 3, 0), ids(&image, 7, 3, 0)], [(1.0, 1.0), (2.0, 1.0)]);
    assert_eq!([ids(&image, 0, 4, 0), ids(&image, 3, 7, 0)], [(1.0, 2.0), (2.0, 2.0)]);
    assert_eq!(ids(&image, 6, 6, 0), (0.0, 0.0));
}

#[test]
fn members_draw_into_their_layers_faces_and_slices() {
    for (kind, depth_layers) in [
        (TextureKind::D2 { array: true }, 6),
        (TextureKind::Cube { array: false }, 6),
        // One depth buffer serves all layers, cleared for each.
        (TextureKind::D2 { array: true }, 1),
        (TextureKind::D3, 1),
    ] {
        let mut s = Sketch::new();
        s.texture("image", kind, F::Rgba16Float, [4, 4, 6]);
        s.texture("depth", TextureKind::D2 { array: true }, F::Depth32Float, [4, 4, depth_layers]);
        let places: Vec<Place> = (0..6).rev().map(Place::Layer).collect();
        let targets = (["image"].as_slice(), Some("depth"));
        let draw = s.draw("draw", SOLID, DrawGeometry::Scene { cull: Cull::Material }, targets, &places);
        let ran = run_scene(s.order([draw]), &quads(), &[]);
        let image = ran.image("image");
        for layer in 0..6 {
            let member = (5 - layer) as f32;
            let got = [ids(&image, 0, 0, layer), ids(&image, 3, 3, layer)];
            assert_eq!(got, [(1.0, member), (2.0, member)], "{kind:?} {layer}");
        }
        assert_eq!((ran.report.steps.len(), ran.report.steps[0].runs), (1, 1));
    }
}

#[test]
fn a_scene_without_triangles_still_clears() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 2, 2);
    s.plan.resources[0].initial = Some([3.0; 4]);
    let targets = (["image"].as_slice(), None);
    let draw = s.draw("draw", SOLID, DrawGeometry::Scene { cull: Cull::Material }, targets, &[Place::Whole]);
    assert_eq!(run(s.order([draw])).image("image").data, [0.0; 16]);
}

#[test]
fn depth_only_draws_feed_comparison_samplers_and_views_fit_the_variable() {
    let mut s = Sketch::new();
    s.image("shadow", F::Depth32Float, 4, 4);
    s.image("image", F::Rgba32Float, 4, 4);
    let vertex = "@vertex fn vertex(@location(0) position: vec3f) -> @builtin(position) vec4f {
        return vec4f(position, 1.0);
    }";
    let targets = ([].as_slice(), Some("shadow"));
    let cast = s.draw("cast", vertex, DrawGeometry::Scene { cull: Cull::Material }, targets, &[Place::Whole]);
    // A plain 2D texture, asked for as an array.
    let look = s.screen(
        "look",
        "var shadow: texture_depth_2d_array;
        var compare: sampler_comparison;
        @fragment fn main(@builtin(position) p: vec4f) -> @location(0) vec4f {
            let near = textureSampleCompareLevel(shadow, compare, p.xy / 4.0, 0, 0.6);
            return vec4f(near, textureLoad(shadow, vec2u(p.xy), 0, 0), 0.0, 1.0);
        }",
        "image",
    );
    let image = run_scene(s.order([cast, look]), &quads(), &[]).image("image");
    assert_eq!(ids(&image, 0, 0, 0), (0.0, 0.5));
    assert_eq!(ids(&image, 3, 0, 0), (1.0, 0.75));
}

#[test]
fn linear_samplers_filter() {
    let mut s = Sketch::new();
    s.image("source", F::Rgba16Float, 2, 1);
    s.image("image", F::Rgba32Float, 1, 1);
    let step = s.screen(
        "step",
        "@fragment fn main(@builtin(position) p: vec4f) -> @location(0) vec4f { return vec4f(floor(p.x)); }",
        "source",
    );
    let sample = s.screen(
        "sample",
        "var source: texture_2d<f32>; var linear: sampler;
        @fragment fn main() -> @location(0) vec4f { return textureSampleLevel(source, linear, vec2f(0.5), 0.0); }",
        "image",
    );
    assert_eq!(run(s.order([step, sample])).image("image").data, [0.5; 4]);
}

const TEXTURED: &str = "
var scene_textures: texture_2d_array<f32>;
@fragment fn main() -> @location(0) vec4f {
    return vec4f(textureLoad(scene_textures, vec2u(0, 0), 1, 0).r, textureLoad(scene_textures, vec2u(0, 0), 0, 1).g, 
        f32(textureNumLayers(scene_textures)), 1.0);
}";

#[test]
fn scene_textures_have_layers_and_mips_and_default_to_white() {
    let mut s = Sketch::new();
    s.image("image", F::Rgba32Float, 1, 1);
    let draw = s.screen("draw", TEXTURED, "image");
    let plan = s.order([draw]);
    let mut level0 = [0u8; 32];
    // Layer 1, texel (0, 0), red.
    level0[16] = 255;
    let textures =
        TextureArray { width: 2, height: 2, layers: 2, mips: vec![level0.to_vec(), vec![0, 255, 0, 0, 0, 0, 0, 0]] };
    for (textures, want) in [(Some(&textures), [1.0, 1.0, 2.0, 1.0]), (None, [1.0, 0.0, 1.0, 1.0])] {
        let mut prepared =
            prepare(gpu(), &plan, &scene::Assets::new(&scene::Geometry::default(), textures), &[]).unwrap();
        execute(gpu(), &plan, &mut prepared, &FrameInputs::default()).unwrap();
        let image = read_image(gpu(), &prepared, &plan, ResourceId(0)).unwrap();
        assert_eq!((image.data[0], image.data[2]), (want[0], want[2]));
        if textures.is_some() {
            assert_eq!(image.data[1], want[1]);
        }
    }
}
