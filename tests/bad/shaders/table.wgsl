// Reads columns that the table of lights doesn't have, or has otherwise.
struct Light {
    positoin: vec3f,
    intensity: f32,
}
var<storage, read> lights: array<Light>;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(lights[0].positoin, lights[0].intensity));
}
