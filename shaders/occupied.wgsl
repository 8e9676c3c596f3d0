//! Which places of the table of cells hold a key.
#import lightgraph::cells::PLACES

var<storage, read> keys: array<u32>;
var<storage, read_write> occupied: array<u32>;

@compute @workgroup_size(64)
fn occupied_places(@builtin(global_invocation_id) id: vec3u) {
    if id.x < PLACES {
        occupied[id.x] = u32(keys[id.x] != 0u);
    }
}
