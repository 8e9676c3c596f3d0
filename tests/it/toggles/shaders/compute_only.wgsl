#import lightgraph::instances

struct Node { transform: mat4x4f }
var<storage, read> nodes: array<Node>;
var<storage, read_write> computed_only: array<f32>;

@compute @workgroup_size(16) fn compute(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) id: vec3u) {
    let at = lightgraph::instances::number(group) * 16u + id.x;
    computed_only[at] = nodes[0].transform[3].x + f32(id.x);
}
