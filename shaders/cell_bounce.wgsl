//! A bounce between the cells: what each sends on of the light that it had, along all links at once.
#import lightgraph::cells::NO_CELL
#import lightgraph::kept::{LINKS, NO_KEY, key_of_cell, link_place}
#import lightgraph::rays::unpack

/// See connect_cells.wgsl.
var link_texels: texture_storage_2d<rgba32uint, read>;
#ifdef ENVIRONMENT
/// Irradiance over pi of the environment.
var<storage, read> of_environment: array<vec4f>;
#endif
/// Irradiance over pi of one bounce and more: before this bounce, after it.
var<storage, read> before: array<vec4f>;
var<storage, read_write> after: array<vec4f>;

@compute @workgroup_size(64)
fn cell_bounce(@builtin(global_invocation_id) id: vec3u) {
    let cell = id.x;
    if key_of_cell(cell) == NO_KEY {
        return;
    }
    var lit = vec3f(0.0);
    // Sent on by cells found; albedo met in cells that are not kept, and what the others have on the mean.
    var sent = vec3f(0.0);
    var lost = vec3f(0.0);
    var mean = vec4f(0.0);
    for (var i = 0u; i < LINKS; i++) {
        let met = unpack(vec4u(0u), textureLoad(link_texels, link_place(cell * LINKS + i)));
        lit += met.lit;
        if met.cell != NO_CELL {
            let light = before[met.cell].rgb;
            sent += met.albedo * light;
            mean += vec4f(light, 1.0);
        } else {
            lost += met.albedo;
        }
    }
    let light = lit + sent + lost * mean.rgb / max(mean.a, 1.0);
    var sum = light / f32(LINKS);
#ifdef ENVIRONMENT
    // No source stands for the environment: cells begin with its light, and have it in every bounce.
    sum += of_environment[cell].rgb;
#endif
    after[cell] = vec4f(sum, 1.0);
}
