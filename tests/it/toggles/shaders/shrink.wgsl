var<storage, read_write> looped: array<f32>;

@compute @workgroup_size(1) fn compute() { looped[0] = looped[0] * 0.5; }
