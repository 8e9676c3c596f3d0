//! The transfer function of sRGB (IEC 61966-2-1), from linear values to codes and back.
#define_import_path lightgraph::srgb

fn encode(linear: vec3f) -> vec3f {
    return select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3f(0.0031308));
}

fn decode(code: vec3f) -> vec3f {
    return select(code / 12.92, pow((code + 0.055) / 1.055, vec3f(2.4)), code > vec3f(0.04045));
}
