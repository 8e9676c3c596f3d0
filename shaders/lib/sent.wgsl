//! Light from one direction that a surface sends on: as a matte surface does, and with GGX round the mirror direction.
//! Where rays end and where photons do, both tell it alike.
#define_import_path lightgraph::sent
#ifdef GGX
#import lightgraph::microfacets::{facets, powers, reflected_shares, unshadowed}
#endif

/// Shares of the light, or the light itself.
struct Sent {
    matte: vec3f,
#ifdef GGX
    glossy: vec3f,
    /// Where it comes from, and the surface's normal.
    direction: vec3f,
    normal: vec3f,
    roughness: f32,
#endif
}

#ifdef GGX
/// Lobes narrower than this roughness's are widened to it: few rays and photons would come upon them, each with a peak.
const LEAST_ROUGHNESS: f32 = 0.3;
const LEAST_COSINE: f32 = 1e-3;
const UP: vec3f = vec3f(0.0, 1.0, 0.0);

fn sent_evenly(light: vec3f) -> Sent {
    return Sent(light, vec3f(0.0), UP, UP, 1.0);
}

/// What goes on towards a viewer, over the same sent evenly.
fn towards(sent: Sent, viewer: vec3f) -> vec3f {
    let incoming = max(dot(sent.normal, sent.direction), LEAST_COSINE);
    let outgoing = max(dot(sent.normal, viewer), LEAST_COSINE);
    let sum = sent.direction + viewer;
    let half = sum * inverseSqrt(max(dot(sum, sum), 1e-12));
    let width = sent.roughness * sent.roughness;
    let lobe = facets(sent.normal, half, width) * unshadowed(incoming, width) * unshadowed(outgoing, width);
    let reflected = max(reflected_shares(sent.roughness, powers(incoming)).x, 0.1);
    return sent.matte + sent.glossy * (3.14159265359 * lobe / (4.0 * incoming * outgoing * reflected));
}
#else
fn sent_evenly(light: vec3f) -> Sent {
    return Sent(light);
}

fn towards(sent: Sent, viewer: vec3f) -> vec3f {
    return sent.matte;
}
#endif
