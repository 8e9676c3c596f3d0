#define_import_path bad::unclosed

fn doubled(x: f32) -> f32 {
    return x * 2.0
}
