//! The light of all bounces at the probes: the inverse matrix times what direct light gives them.
#import lightgraph::probes
#import lightgraph::sh::COUNT

struct Params {
    grid: vec3u,
}
var<uniform> params: Params;
var<storage, read> matrix: array<vec4f>;
var sh_source: texture_3d<f32>;
var openness: texture_3d<f32>;
var sh: texture_storage_3d<rgba32float, write>;

/// x: the probe; y: the coefficient.
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let count = params.grid.x * params.grid.y * params.grid.z;
    if id.x >= count || id.y >= COUNT {
        return;
    }
    let start = (id.x * COUNT + id.y) * count * COUNT;
    var light = vec3f(0.0);
    for (var q = 0u; q < count; q++) {
        let giver = probes::coordinates(q);
        var part = vec3f(0.0);
        for (var j = 0u; j < COUNT; j++) {
            let source = textureLoad(sh_source, vec3u(giver.xy, giver.z + j * params.grid.z), 0).rgb;
            part += matrix[start + q * COUNT + j].rgb * source;
        }
        light += part;
    }
    let probe = probes::coordinates(id.x);
    let open = select(0.0, textureLoad(openness, probe, 0).a, id.y == 0u);
    textureStore(sh, vec3u(probe.xy, probe.z + id.y * params.grid.z), vec4f(light, open));
}
