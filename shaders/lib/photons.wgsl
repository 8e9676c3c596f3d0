//! Places where light of the scene's lights and emitters arrives, each with an equal part of it, from which surfaces
//! are lit as from points (Keller, "Instant Radiosity", 1997). Rays that a surface sends out meet the same light. Both
//! count by how likely each comes upon a place (the balance heuristic of Veach, 1997), so that near ones bring no
//! peaks.
#define_import_path lightgraph::photons
#ifdef GGX
#import lightgraph::octahedron::{fold, unfold}
#import lightgraph::rays::pack_normal
#endif
#import lightgraph::packed_light
#import lightgraph::rays::unpack_normal
#import lightgraph::sent::{Sent, towards}

const PHOTONS: u32 = #{PHOTONS}u;
/// How many rays count as much as a source that is chosen by what it gives.
const RAYS_A_SOURCE: f32 = 0.5;

fn sum_of(color: vec3f) -> f32 {
    return dot(color, vec3f(1.0));
}

/// How many sources there are.
struct Count {
    count: u32,
    /// See `halves_of`.
    scale: f32,
    /// Elements of a uniform array are 16 bytes long.
    unused: vec2u,
}

/// A place that sends light on.
struct Source {
    position: vec3f,
    /// Of the triangle itself, on the side that is lit.
    flat_normal: vec3f,
    /// W/sr along that normal, as if it stood for all sources.
    intensity: Sent,
    /// Of coming upon it among the sources, in 1/m², as either half of the looks at emitters tells it.
    densities: vec2f,
}

#ifdef GGX
/// Texels of a source.
const TEXELS: u32 = 3u;

fn unpack_source(a: vec4u, b: vec4u, c: vec4u) -> Source {
    let surface = unpack4x8snorm(c.w);
    let sent = Sent(
        packed_light::unpack(b.xy), packed_light::unpack(c.xy), unpack_normal(c.z), unfold(surface.xy), surface.z,
    );
    return Source(bitcast<vec3f>(a.xyz), unpack_normal(a.w), sent, bitcast<vec2f>(b.zw));
}

/// What a lobe sends on, as `unpack_source` reads it.
fn pack_glossy(sent: Sent) -> vec4u {
    let surface = pack4x8snorm(vec4f(fold(sent.normal), sent.roughness, 0.0));
    return vec4u(packed_light::pack(sent.glossy), pack_normal(sent.direction), surface);
}
#else
const TEXELS: u32 = 2u;

fn unpack_source(a: vec4u, b: vec4u) -> Source {
    let sent = Sent(packed_light::unpack(b.xy));
    return Source(bitcast<vec3f>(a.xyz), unpack_normal(a.w), sent, bitcast<vec2f>(b.zw));
}
#endif

/// Light that arrives at a place, the sum of the channels, as either half of the looks at emitters tells it; `apart` is
/// half their difference. Times the `scale` that sources.wgsl keeps it is the density with which photons come there.
///
/// The weight of what one half tells follows from the other half. A weight from the same samples would be smaller
/// wherever they happen to see more, and the sum too dark.
fn halves_of(arrived: f32, apart: f32) -> vec2f {
    return max(arrived + vec2f(apart, -apart), vec2f(0.0));
}

/// What a surface sees of another, over pi: the density of its rays there, in 1/m². `other` is its flat normal.
fn form(offset: vec3f, normal: vec3f, other: vec3f) -> f32 {
    let square = max(dot(offset, offset), 1e-12);
    let way = offset * inverseSqrt(square);
    return max(dot(normal, way), 0.0) * max(-dot(other, way), 0.0) / (3.14159265359 * square);
}

/// Radiance that a white surface sends on of a source that it sees, as rays leave it for the source: `rays` of them
/// for each source asked.
fn from_source(s: Source, position: vec3f, normal: vec3f, rays: f32) -> vec3f {
    let offset = position - s.position;
    let way = offset * inverseSqrt(max(dot(offset, offset), 1e-12));
    let f = form(-offset, normal, s.flat_normal);
    return towards(s.intensity, way) * (f * share_of_source(f, s.densities, rays));
}

/// The share that a source counts.
fn share_of_source(form: f32, densities: vec2f, rays: f32) -> f32 {
    return dot(densities / max(rays * form + densities, vec2f(1e-30)), vec2f(0.5));
}

/// About what a source sends on to a surface, more than nothing wherever it may light one beside it.
fn promised(s: Source, position: vec3f, normal: vec3f) -> f32 {
    let offset = s.position - position;
    let square = max(dot(offset, offset), 1e-12);
    let way = offset * inverseSqrt(square);
    let f = max(dot(normal, way), 0.1) * max(-dot(s.flat_normal, way), 0.02) / (3.14159265359 * square);
    return sum_of(towards(s.intensity, -way)) * (f * share_of_source(f, s.densities, 1.0));
}

/// The share that light counts which a ray meets by chance; see `halves_of`.
fn share_of_ray(form: f32, halves: vec2f, scale: f32, rays: f32) -> f32 {
    let shares = rays * form / max(rays * form + scale * halves.yx, vec2f(1e-30));
    return dot(halves, shares) / max(halves.x + halves.y, 1e-30);
}
