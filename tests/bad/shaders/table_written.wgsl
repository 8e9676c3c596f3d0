// Writes to a table of the scene.
struct Node {
    transform: mat4x4f,
}
var<storage, read_write> nodes: array<Node>;

@compute @workgroup_size(1)
fn write_node() {
    nodes[0].transform[0][0] = 2.0;
}
