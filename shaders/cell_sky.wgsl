//! Light that comes to the cells straight from the environment, told from where their rays leave.
#import lightgraph::cells::PLACES
#import lightgraph::environment_light::reflected_environment
#import lightgraph::packed_light
#import lightgraph::random::scramble
#import lightgraph::rays::unpack
#import lightgraph::rounds::salt
#import lightgraph::surface::Surface
#import lightgraph::trace::leave

const LINKS: u32 = #{LINKS}u;
const KEPT: u32 = #{KEPT}u;
var<uniform> cell_samples: u32;
var<storage, read> keys: array<u32>;
var<storage, read> met_by: array<vec4u>;
var<storage, read> kept: array<u32>;
/// What the place that a ray leaves has of the environment, as a white surface would send it on.
var<storage, read_write> link_emission: array<vec2u>;

@compute @workgroup_size(64)
fn cell_sky(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let at_once = 64u * groups.x / LINKS;
    if id.x >= at_once * LINKS {
        return;
    }
    let link = id.x % LINKS;
    for (var place = id.x / LINKS; place < PLACES; place += at_once) {
        let key = keys[place];
        if key == 0u {
            continue;
        }
        let row = kept[place * KEPT + link % KEPT] & 0x3fffffu;
        let here = unpack(met_by[2u * row], met_by[2u * row + 1u]);
        var s = Surface();
        s.position = here.position;
        s.normal = here.normal;
        s.view = here.normal;
        s.albedo = vec3f(1.0);
        let start = leave(here.position, here.normal);
        let light = reflected_environment(s, start, cell_samples, scramble(scramble(key) + link + salt()));
        link_emission[place * LINKS + link] = packed_light::pack(light);
    }
}
