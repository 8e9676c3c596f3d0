//! What rays met, kept: a point on a surface in two times four words.
#define_import_path lightgraph::rays
#import lightgraph::octahedron::{fold, unfold}
#import lightgraph::packed_light

struct Ray {
    position: vec3f,
    /// Unit, on the side met: as the surface is shaded, and of the triangle itself.
    normal: vec3f,
    flat_normal: vec3f,
    albedo: vec3f,
    /// Irradiance from the scene's lights over pi, as far as it goes on the way that the ray came; once connected, the
    /// radiance that it brings straight from lights and emitters.
    lit: vec3f,
    /// How much more of it goes on in all directions, on the mean: 2 to the power of this.
    evenly: f32,
    /// Of its cell: the key, then the place; 0 or NO_CELL for none, SKY where the ray left the scene.
    cell: u32,
}

/// In place of a cell: the ray left the scene.
const SKY: u32 = 0xfffffffeu;
/// Marks what such a ray brings, beside the row of a source that its point looked at.
const OF_SKY: u32 = 0x80000000u;

/// Steps of the root of what an albedo lacks to 1; see `packed_surface`.
const STEPS: vec3f = vec3f(2047.0, 2047.0, 1023.0);

fn pack_normal(normal: vec3f) -> u32 {
    return pack2x16snorm(fold(normal));
}

fn unpack_normal(word: u32) -> vec3f {
    return unfold(unpack2x16snorm(word));
}

fn pack_normals(normal: vec3f, flat_normal: vec3f) -> u32 {
    return pack4x8snorm(vec4f(fold(normal), fold(flat_normal)));
}

fn unpack_flat_normal(word: u32) -> vec3f {
    return unfold(unpack4x8snorm(word).zw);
}

/// Steps of `evenly` from one power of two to the next, and where the bits of it stand beside those of the light.
const EVENLY_STEPS: f32 = 16.0;
const EVENLY_SHIFT: u32 = 24u;

fn pack(r: Ray) -> array<vec4u, 2> {
    let evenly = bitcast<u32>(i32(clamp(round(EVENLY_STEPS * r.evenly), -128.0, 127.0)));
    let lack = vec3u(sqrt(clamp(vec3f(1.0) - r.albedo, vec3f(0.0), vec3f(1.0))) * STEPS + 0.5);
    let colors = lack.r | lack.g << 11u | lack.b << 22u;
    return array<vec4u, 2>(
        vec4u(bitcast<vec3u>(r.position), pack_normals(r.normal, r.flat_normal)),
        vec4u(packed_light::pack(r.lit) | vec2u(0u, evenly << EVENLY_SHIFT), colors, r.cell),
    );
}

fn unpack(a: vec4u, b: vec4u) -> Ray {
    let lack = vec3f(vec3u(b.z & 2047u, b.z >> 11u & 2047u, b.z >> 22u)) / STEPS;
    return Ray(
        bitcast<vec3f>(a.xyz),
        unfold(unpack4x8snorm(a.w).xy),
        unpack_flat_normal(a.w),
        vec3f(1.0) - lack * lack,
        packed_light::unpack(b.xy & vec2u(0xffffffffu, (1u << EVENLY_SHIFT) - 1u)),
        f32(bitcast<i32>(b.y) >> EVENLY_SHIFT) / EVENLY_STEPS,
        b.w,
    );
}
