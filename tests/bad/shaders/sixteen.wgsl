// Needs a buffer of sixteen numbers.
var<storage, read_write> numbers: array<f32, 16>;

@compute @workgroup_size(1)
fn count() {
    numbers[0] = 1.0;
}
