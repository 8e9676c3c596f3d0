//! What a probe sees in 16 bytes a texel: as `lightgraph::surface` records it, with albedo in 16 bits a channel and the
//! normal in 2 x 16 bits (3e-5 rad).
//!
//! x: red, green; y: blue and, in the upper half, 1 + the material's row; z: the normal on an unfolded octahedron;
//! w: the distance, negative for the back of a double-sided material. No light: row 0, and the distance tells what.
//!
//! Of albedo the root of what it lacks to 1 is kept. After many bounces light grows with 1 / (1 - albedo): a step of
//! 16 bits of albedo itself would show at 0.999, where this one is 5e-7. The error is 1.6e-5 at most, of dark albedos.
#define_import_path lightgraph::packed_surface
#import lightgraph::octahedron
#import lightgraph::surface::Record
#ifdef GLOW
#import lightgraph::surface::{glows, is_lit, join, material_of, materials, part}
#endif

/// What all probes see; tile 6p + f is face f of probe p.
var cube_surface: texture_storage_2d<rgba32uint, read>;

#ifdef GLOW
/// Whether of two colours, albedo and glow, 8 bits each are kept.
fn halves(albedo: vec4f) -> bool {
    return is_lit(albedo) && glows(materials[material_of(albedo)]);
}
#endif

fn pack(r: Record) -> vec4u {
    var lack = sqrt(max(vec3f(1.0) - r.albedo.rgb, vec3f(0.0)));
#ifdef GLOW
    if halves(r.albedo) {
        let both = part(r.albedo.rgb);
        lack = (round(255.0 * sqrt(both[0])) + 256.0 * round(255.0 * sqrt(both[1]))) / 65535.0;
    }
#endif
    let code = u32(abs(r.albedo.a)) << 16u;
    let back = select(1.0, -1.0, r.albedo.a < 0.0);
    return vec4u(
        pack2x16unorm(lack.rg),
        pack2x16unorm(vec2f(lack.b, 0.0)) | code,
        pack2x16snorm(octahedron::fold(select(vec3f(0.0, 0.0, 1.0), r.normal.xyz, r.normal.w > 0.0))),
        bitcast<u32>(r.normal.w * back),
    );
}

fn unpack(words: vec4u) -> Record {
    let depth = bitcast<f32>(words.w);
    let code = f32(words.y >> 16u);
    let lack = vec3f(unpack2x16unorm(words.x), unpack2x16unorm(words.y).x);
    var color = vec3f(1.0) - lack * lack;
#ifdef GLOW
    if halves(vec4f(color, code)) {
        let both = round(65535.0 * lack);
        let high = floor(both / 256.0);
        let low = both - 256.0 * high;
        color = join(low * low / 65025.0, high * high / 65025.0);
    }
#endif
    return Record(
        vec4f(color, select(code, -code, depth < 0.0)),
        vec4f(octahedron::unfold(unpack2x16snorm(words.z)), abs(depth)),
    );
}

/// What a texel of the atlas holds.
fn surface_at(at: vec2u) -> Record {
    return unpack(textureLoad(cube_surface, at));
}
