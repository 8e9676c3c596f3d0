//! The instances of a pass with `each`: which one a workgroup works for. Import it in a compute shader, and use
//! `number(group)` and `within(group)` in place of the workgroup's own number.
#define_import_path lightgraph::instances

/// Workgroups of an instance along x; instances along x; 1 where dirty instances run alone, else 0; how many run. Then
/// their numbers.
var<storage, read> instances: array<u32>;

const HEADER: u32 = 4u;

/// The number of the instance that a workgroup works for.
fn number(group: vec3u) -> u32 {
    return instances[HEADER + group.z * instances[1] + group.x / instances[0]];
}

/// The place of a workgroup among those of its instance.
fn within(group: vec3u) -> vec2u {
    return vec2u(group.x % instances[0], group.y);
}

/// Whether the dirty instances run alone, so that what they made before is still there.
fn in_part() -> bool {
    return instances[2] != 0u;
}
