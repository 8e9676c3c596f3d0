//! The photons that light something, in their order.
#import lightgraph::cells::NO_CELL
#import lightgraph::photons::{Count, PHOTONS, TEXELS, halves_of, sum_of}
#import lightgraph::packed_light

/// Of `photon_ends`, of a photon; see photons.wgsl.
const ROWS: u32 = TEXELS + 1u;
const LANES: u32 = 128u;
const EACH: u32 = (PHOTONS + LANES - 1u) / LANES;
var<storage, read> photon_ends: array<vec4u>;
var<storage, read> emitted: array<vec4f>;
/// As `lightgraph::source_texels` reads them.
var source_texels: texture_storage_2d<rgba32uint, write>;
const SOURCES_A_ROW: u32 = 128u;
var<storage, read_write> source_count: Count;
var<workgroup> counts: array<u32, LANES>;

fn is_source(i: u32) -> bool {
    return i < PHOTONS && photon_ends[ROWS * i + 2u].y != 0u;
}

@compute @workgroup_size(LANES)
fn gather_sources(@builtin(local_invocation_id) id: vec3u) {
    var own = 0u;
    for (var i = 0u; i < EACH; i++) {
        own += u32(is_source(id.x * EACH + i));
    }
    counts[id.x] = own;
    workgroupBarrier();
    var at = 0u;
    var all = 0u;
    for (var i = 0u; i < LANES; i++) {
        at += select(0u, counts[i], i < id.x);
        all += counts[i];
    }
    let power = bitcast<f32>(photon_ends[2].x);
    // Where there is no source, rays bring all light themselves.
    let scale = select(0.0, 3.14159265359 * f32(PHOTONS) / (f32(all) * max(power, 1e-30)), all > 0u);
    for (var i = 0u; i < EACH; i++) {
        let k = id.x * EACH + i;
        if is_source(k) {
            let b = photon_ends[ROWS * k + 1u];
            var arrived = vec2f(bitcast<f32>(b.z));
            if b.w != NO_CELL {
                let found = emitted[b.w];
                arrived += halves_of(sum_of(found.rgb), found.a);
            }
            // As if it stood for all.
            let sent = packed_light::pack(packed_light::unpack(b.xy) * f32(all));
            let place = vec2u(TEXELS * (at % SOURCES_A_ROW), at / SOURCES_A_ROW);
            textureStore(source_texels, place, photon_ends[ROWS * k]);
            textureStore(source_texels, place + vec2u(1u, 0u), vec4u(sent, bitcast<vec2u>(scale * arrived)));
#ifdef GGX
            let c = photon_ends[ROWS * k + 3u];
            let glossy = packed_light::pack(packed_light::unpack(c.xy) * f32(all));
            textureStore(source_texels, place + vec2u(2u, 0u), vec4u(glossy, c.zw));
#endif
            at++;
        }
    }
    if id.x == 0u {
        source_count = Count(all, scale, vec2u(0u));
    }
}
