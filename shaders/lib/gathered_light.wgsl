//! What frames gathered of a pixel's indirect light. Where the camera moved between them, its position is the mean of
//! where they found it: light that is taken along is not blurred from frame to frame.
#define_import_path lightgraph::gathered_light

struct GatheredLight {
    /// Over the albedo.
    light: vec3f,
    /// That it is the mean of.
    frames: f32,
    /// In the world.
    position: vec3f,
    /// Packed; NO_POINT where a moved camera can't take the light along.
    normal: u32,
}
