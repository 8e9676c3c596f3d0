//! Light that comes to the cells straight from the environment, told from where their rays leave.
#import lightgraph::environment_light::reflected_environment
#import lightgraph::kept::{NO_KEY, key_of_cell, leaves}
#import lightgraph::packed_light
#import lightgraph::random::scramble
#import lightgraph::rounds::salt
#import lightgraph::surface::Surface
#import lightgraph::trace::leave

const LINKS: u32 = #{LINKS}u;
var<uniform> cell_samples: u32;
/// What the place that a ray leaves has of the environment, as a white surface would send it on.
var<storage, read_write> link_emission: array<vec2u>;

@compute @workgroup_size(64)
fn cell_sky(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x / LINKS;
    let link = id.x % LINKS;
    let key = key_of_cell(cell);
    if key == NO_KEY {
        return;
    }
    let here = leaves(cell, link);
    var s = Surface();
    s.position = here.position;
    s.normal = here.normal;
    s.view = here.normal;
    s.albedo = vec3f(1.0);
    let start = leave(here.position, here.flat_normal);
    let light = reflected_environment(s, start, cell_samples, scramble(scramble(key) + link + salt()));
    link_emission[id.x] = packed_light::pack(light);
}
