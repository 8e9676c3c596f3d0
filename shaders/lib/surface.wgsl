//! What a ray meets: recorded by the draw passes in two texels, read back by the compute passes.
//!
//! `albedo`: colour in rgb; in a, 1 + the material's row, negative for the back of a double-sided one, and 0 for what
//! gives no light (nothing, or the back of a single-sided material, which is black).
//! `normal`: unit normal on the side seen in xyz; in w the distance along the ray in metres, 0 for nothing.
//! All f32: an albedo in 8 or 16 bits would be amplified by 1/(1 - albedo) over the bounces.
#define_import_path lightgraph::surface

struct Material {
    base_color: vec4f,
    /// Layer of `scene_textures`, 0xffffffff for none.
    base_color_texture: u32,
    /// Radiance that leaves the front.
    emission: vec3f,
    double_sided: u32,
    /// Phong strength and exponent.
    specular: f32,
    shininess: f32,
#ifdef GGX
    roughness: f32,
    metallic: f32,
#endif
}
var<storage, read> materials: array<Material>;

#ifdef TEXTURES
var scene_textures: texture_2d_array<f32>;
var texture_sampler: sampler;
#endif

/// The two texels of a surface.
struct Record {
    albedo: vec4f,
    normal: vec4f,
}

/// Records a point `depth` metres along the ray. Call it in uniform control flow of a fragment entry only.
fn record(material: u32, uv: vec2f, normal: vec3f, depth: f32, front: bool) -> Record {
    let m = materials[material];
    var color = m.base_color.rgb;
#ifdef TEXTURES
    let textured = m.base_color_texture != 0xffffffffu;
    let texel = textureSample(scene_textures, texture_sampler, uv, select(0u, m.base_color_texture, textured));
    color *= select(vec3f(1.0), texel.rgb, textured);
#endif
    let n = normalize(normal);
    let code = f32(material + 1u);
    if front {
        return Record(vec4f(color, code), vec4f(n, depth));
    }
    if m.double_sided != 0u {
        return Record(vec4f(color, -code), vec4f(-n, depth));
    }
    return Record(vec4f(0.0), vec4f(-n, depth));
}

/// A point that light leaves.
struct Surface {
    position: vec3f,
    /// Unit, on the side seen.
    normal: vec3f,
    /// Unit, to whom sees it.
    view: vec3f,
    albedo: vec3f,
    emission: vec3f,
    /// Row of `materials`.
    material: u32,
    specular: f32,
    shininess: f32,
#ifdef GGX
    roughness: f32,
    metallic: f32,
#endif
}

/// Whether light leaves what was recorded.
fn is_lit(albedo: vec4f) -> bool {
    return albedo.a != 0.0;
}

/// Whether what was recorded is the back of a single-sided surface.
fn is_back(albedo: vec4f, normal: vec4f) -> bool {
    return !is_lit(albedo) && normal.w > 0.0;
}

/// Whether nothing was recorded: what is seen is the environment.
fn is_nothing(albedo: vec4f, normal: vec4f) -> bool {
    return !is_lit(albedo) && normal.w <= 0.0;
}

/// The surface recorded along a ray; only where `is_lit`.
fn read_record(albedo: vec4f, normal: vec4f, origin: vec3f, direction: vec3f) -> Surface {
    let row = u32(max(abs(albedo.a), 1.0)) - 1u;
    let m = materials[row];
    return Surface(
        origin + normal.w * direction,
        normal.xyz,
        -direction,
        albedo.rgb,
        select(vec3f(0.0), m.emission, albedo.a > 0.0),
        row,
        m.specular,
        m.shininess,
#ifdef GGX
        m.roughness,
        m.metallic,
#endif
    );
}
