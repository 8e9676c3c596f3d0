//! The light that surfaces of a roughness mirror of what is all around, by the direction in which they mirror, as seen
//! head on. Or, with MATTE, the irradiance over pi of what faces a direction.
//!
//! Each direction reads a level whose texels are as large as its share of the lobe, so that few of them leave no
//! speckles (Colbert and Krivanek, "GPU-Based Importance Sampling", 2007).
#import lightgraph::cube::direction
#import lightgraph::microfacets::{draw_facet, facets}
#import lightgraph::random::even_pair
#import lightgraph::sampling::cosine_direction

var around: texture_cube<f32>;
var linear: sampler;
var softened: texture_storage_2d_array<rgba16float, write>;

struct Params {
    samples: u32,
#ifndef MATTE
    roughness: f32,
#endif
}
var<uniform> params: Params;

const PI: f32 = 3.14159265359;

/// The light from a direction that is drawn with this density, in 1/sr.
fn light_from(d: vec3f, density: f32) -> vec3f {
    let edge = f32(textureDimensions(around).x);
    let texel = 4.0 * PI / (6.0 * edge * edge);
    let share = 1.0 / (f32(params.samples) * max(density, 1e-6));
    return textureSampleLevel(around, linear, d, max(0.5 * log2(share / texel) + 1.0, 0.0)).rgb;
}

@compute @workgroup_size(8, 8)
fn soften(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(softened).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let axis = direction(id.z, id.xy, edge);
    var sum = vec4f(0.0);
    for (var i = 0u; i < params.samples; i++) {
        let u = even_pair(i, 0u);
#ifdef MATTE
        let d = cosine_direction(axis, u);
        sum += vec4f(light_from(d, max(dot(axis, d), 0.0) / PI), 1.0);
#else
        let width = max(params.roughness * params.roughness, 0.001);
        let facet = draw_facet(axis, axis, width, u);
        let d = reflect(-axis, facet);
        let cosine = dot(axis, d);
        if cosine > 0.0 {
            // Those that leave at grazing angles count less, as they would on the surface.
            sum += vec4f(cosine * light_from(d, 0.25 * facets(axis, facet, width)), cosine);
        }
#endif
    }
    textureStore(softened, id.xy, id.z, vec4f(sum.rgb / max(sum.a, 1e-6), 1.0));
}
