#define_import_path bad::ring_a
#import bad::ring_b::b

fn a() -> f32 {
    return b();
}
