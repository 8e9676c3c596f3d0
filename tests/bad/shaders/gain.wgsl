// A colour scaled by a parameter.
struct Settings {
    gain: f32,
}
var<uniform> settings: Settings;

struct Targets {
    @location(0) color: vec4f,
}

@fragment
fn fragment() -> Targets {
    return Targets(vec4f(settings.gain));
}
