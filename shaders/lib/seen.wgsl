//! What the camera sees, as camera_surface.wgsl records it: `seen_at` a pixel (column, row from the top). It is loaded
//! from images, which software drivers do in place where a texture costs them a call; with TRACE_TEXELS, whose images
//! leave room for no others, from textures. With FINISH it records roughness and metalness, too.
#define_import_path lightgraph::seen
#import lightgraph::surface::{Record, Surface}

#ifdef TRACE_TEXELS
var surface_albedo: texture_2d<f32>;
var surface_normal: texture_2d<f32>;

fn seen_at(pixel: vec2u) -> Record {
    return Record(textureLoad(surface_albedo, pixel, 0), textureLoad(surface_normal, pixel, 0));
}
#else
var surface_albedo: texture_storage_2d<rgba32float, read>;
var surface_normal: texture_storage_2d<rgba32float, read>;

fn seen_at(pixel: vec2u) -> Record {
    return Record(textureLoad(surface_albedo, pixel), textureLoad(surface_normal, pixel));
}
#endif

#ifdef FINISH
var surface_finish: texture_2d<f32>;
#endif

/// What a pixel shows, as rough and metallic as it is there.
fn finished(s: Surface, pixel: vec2u) -> Surface {
    var there = s;
#ifdef FINISH
    let finish = textureLoad(surface_finish, pixel, 0);
    there.roughness = finish.x;
    there.metallic = finish.y;
#endif
    return there;
}
