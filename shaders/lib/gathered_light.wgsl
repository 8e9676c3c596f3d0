//! What frames gathered of a pixel's light. Where the camera moved between them, its position is the mean of where they
//! found it: light that is taken along is not blurred from frame to frame.
#define_import_path lightgraph::gathered_light

struct GatheredLight {
    /// The mean of frames that show the same.
    direct: vec4f,
    /// Indirect light over the albedo, and the frames that it is the mean of.
    indirect: vec4f,
    /// In the world.
    position: vec3f,
    /// Packed; NO_POINT where a moved camera can't take the light along.
    normal: u32,
}
