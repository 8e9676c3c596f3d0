//! A particle, as those who move it and those who show it have it.
#define_import_path play::particle

struct Particle {
    /// In heights of the image, from the middle of its lower edge.
    position: vec2f,
    velocity: vec2f,
    color: vec3f,
    /// Seconds that it glows on; below 0 since when it rests.
    life: f32,
}
