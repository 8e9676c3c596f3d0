struct Node { transform: mat4x4f }
var<storage, read> nodes: array<Node>;
var<storage, read_write> bits: array<u32>;

@compute @workgroup_size(1) fn compute() { bits[0] = select(7u, 15u, nodes[0].transform[3].x > 100.0); }
