#define_import_path bad::typed

fn doubled(x: f32) -> f32 {
    let two: u32 = 2.0;
    return x * f32(two);
}
