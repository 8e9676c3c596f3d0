#define_import_path bad::half

fn half_of(x: f32) -> f32 {
    return x * 0.5;
}
