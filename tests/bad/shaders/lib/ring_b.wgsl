#define_import_path bad::ring_b
#import bad::ring_a::a

fn b() -> f32 {
    return a();
}
