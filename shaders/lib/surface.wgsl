//! What a ray meets: recorded by the draw passes in two texels, read back by the compute passes.
//!
//! `albedo`: colour in rgb; in a, 1 + the material's row, negative for the back of a double-sided one, and 0 for what
//! gives no light (nothing, or the back of a single-sided material, which is black). `normal`: unit normal on the side
//! seen in xyz; in w the distance along the ray in metres, 0 for nothing. All f32: an albedo in 8 or 16 bits would be
//! amplified by 1/(1 - albedo) over the bounces. With GLOW, of materials with an emissive texture, and of those that no
//! light shows, each of rgb holds two numbers of 12 bits: `albedo_of` and `glow_of` tell them apart.
//!
//! What a material is at a point is asked here alone: by draws, and by rays. A definition leaves out what no material
//! of the scene has: TEXTURES any texture, SECOND_UVS a second set of coordinates, VERTEX_COLORS, NORMAL_MAPS, METALS
//! roughness and metalness, FINISH_MAPS those by textures, EMISSION_MAPS, MASKS holes, UNLIT, SMOOTH normals that are
//! not the triangles', FACES what reflects at its face, COATS clear layers, CLEAR what lets light through.
#define_import_path lightgraph::surface
#ifdef METALS
#ifndef GGX
#import lightgraph::microfacets::{MEAN_POWERS, reflected_shares}
#endif
#endif
#ifdef TEXTURES
#import lightgraph::textures
#endif

struct Material {
    base_color: vec4f,
    /// Row of `textures`, 0xffffffff for none; as all that follow.
    base_color_texture: u32,
    /// Radiance that leaves the front.
    emission: vec3f,
    double_sided: u32,
    /// Phong strength and exponent.
    specular: f32,
    shininess: f32,
#ifdef METALS
    roughness: f32,
    metallic: f32,
#ifdef FINISH_MAPS
    finish_texture: u32,
#endif
#endif
#ifdef EMISSION_MAPS
    emission_texture: u32,
#endif
#ifdef NORMAL_MAPS
    normal_texture: u32,
    normal_scale: f32,
#endif
#ifdef SMOOTH
    normal_deviation: f32,
#endif
#ifdef MASKS
    /// Nothing is there where alpha is less.
    alpha_cutoff: f32,
#endif
#ifdef UNLIT
    unlit: u32,
#endif
#ifdef CLEAR
    alpha_blend: u32,
    transmission: f32,
    transmission_texture: u32,
#endif
#ifdef FACES
    face: vec4f,
    faced: u32,
    face_texture: u32,
    face_tint_texture: u32,
#endif
#ifdef COATS
    coat: f32,
    coat_texture: u32,
    coat_roughness: f32,
    coat_roughness_texture: u32,
#ifdef NORMAL_MAPS
    coat_normal_texture: u32,
    coat_normal_scale: f32,
#endif
#endif
}
var<storage, read> materials: array<Material>;

/// No row of `textures`.
const NO_TEXTURE: u32 = 0xffffffffu;

/// What vertices say of a point between them.
struct Point {
    uv: vec2f,
#ifdef SECOND_UVS
    second_uv: vec2f,
#endif
#ifdef VERTEX_COLORS
    color: vec4f,
#endif
#ifdef NORMAL_MAPS
    /// In the world; in w the side of the third axis.
    tangent: vec4f,
#endif
}

/// What coordinates grow by from pixel to pixel, a column an axis.
struct Wide {
    uv: mat2x2f,
#ifdef SECOND_UVS
    second_uv: mat2x2f,
#endif
}

#ifdef TEXTURES
/// A texture at a point: white for none.
fn read_texture(row: u32, p: Point, wide: Wide) -> vec4f {
    if row == NO_TEXTURE {
        return vec4f(1.0);
    }
#ifdef SECOND_UVS
    if textures::textures[row].uv_set == 1u {
        return textures::filtered(row, p.second_uv, wide.second_uv);
    }
#endif
    return textures::filtered(row, p.uv, wide.uv);
}
#endif

/// Colour and alpha.
fn base_color(m: Material, p: Point, wide: Wide) -> vec4f {
    var color = m.base_color;
#ifdef VERTEX_COLORS
    color *= p.color;
#endif
#ifdef TEXTURES
    color *= read_texture(m.base_color_texture, p, wide);
#endif
    return color;
}

#ifdef MASKS
/// Whether nothing is there.
fn is_hole(m: Material, alpha: f32) -> bool {
    return alpha < m.alpha_cutoff;
}
#endif

#ifdef NORMAL_MAPS
/// The unit normal, as a normal map bends it by `scale`.
fn bent_by(map: u32, scale: f32, normal: vec3f, p: Point, wide: Wide) -> vec3f {
    let n = normalize(normal);
    if map == NO_TEXTURE {
        return n;
    }
    let texel = 2.0 * read_texture(map, p, wide).xyz - 1.0;
    let along = p.tangent.xyz - dot(p.tangent.xyz, n) * n;
    let x = along * inverseSqrt(max(dot(along, along), 1e-20));
    let y = p.tangent.w * cross(n, x);
    let bent = scale * (texel.x * x + texel.y * y) + texel.z * n;
    return bent * inverseSqrt(max(dot(bent, bent), 1e-20));
}
#endif

/// The unit normal, as its map bends it.
fn bent_normal(m: Material, normal: vec3f, p: Point, wide: Wide) -> vec3f {
#ifdef NORMAL_MAPS
    return bent_by(m.normal_texture, m.normal_scale, normal, p, wide);
#else
    return normalize(normal);
#endif
}

#ifdef COATS
/// The same of the clear layer on top, which has a map of its own.
fn bent_coat_normal(m: Material, normal: vec3f, p: Point, wide: Wide) -> vec3f {
#ifdef NORMAL_MAPS
    return bent_by(m.coat_normal_texture, m.coat_normal_scale, normal, p, wide);
#else
    return normalize(normal);
#endif
}
#endif

#ifdef METALS
/// Roughness and metalness.
fn finish(m: Material, p: Point, wide: Wide) -> vec2f {
    var found = vec2f(m.roughness, m.metallic);
#ifdef FINISH_MAPS
    found *= read_texture(m.finish_texture, p, wide).gb;
#endif
    return found;
}

/// The same on average, for what knows no point.
fn mean_finish(m: Material) -> vec2f {
    var found = vec2f(m.roughness, m.metallic);
#ifdef FINISH_MAPS
    if m.finish_texture != NO_TEXTURE {
        found *= textures::mean(m.finish_texture).gb;
    }
#endif
    return found;
}
#endif

#ifdef FACES
/// What the face reflects if it is no metal: head on, and in w at grazing angles.
fn face_of(m: Material) -> vec4f {
#ifndef DIELECTRICS
    if m.faced == 0u {
        return vec4f(0.0);
    }
#endif
    return m.face;
}

/// The same on average, for what knows no point.
fn mean_face(m: Material) -> vec4f {
    var found = face_of(m);
#ifdef TEXTURES
    if m.face_texture != NO_TEXTURE {
        found *= textures::mean(m.face_texture).a;
    }
    if m.face_tint_texture != NO_TEXTURE {
        found *= vec4f(textures::mean(m.face_tint_texture).rgb, 1.0);
    }
#endif
    return found;
}
#endif

#ifdef COATS
/// Share and roughness of the clear layer, for what knows no point.
fn mean_coat(m: Material) -> vec2f {
    var found = vec2f(m.coat, m.coat_roughness);
#ifdef TEXTURES
    if m.coat_texture != NO_TEXTURE {
        found.x *= textures::mean(m.coat_texture).r;
    }
    if m.coat_roughness_texture != NO_TEXTURE {
        found.y *= textures::mean(m.coat_roughness_texture).g;
    }
#endif
    return found;
}
#endif

/// The albedo of what has this colour. Where metals have no lobes, they are matte, as bright as those on the mean.
fn albedo_at(m: Material, color: vec3f, p: Point, wide: Wide) -> vec3f {
#ifdef METALS
#ifndef GGX
#ifdef UNLIT
    if m.unlit != 0u {
        return color;
    }
#endif
    let found = finish(m, p, wide);
    let shares = reflected_shares(found.x, MEAN_POWERS);
    return mix(color, shares.x * color + shares.y * (vec3f(1.0) - color), found.y);
#endif
#endif
    return color;
}

#ifdef GLOW
/// Whether what is recorded of a material holds more than its albedo.
fn glows(m: Material) -> bool {
    var found = false;
#ifdef EMISSION_MAPS
    found = m.emission_texture != NO_TEXTURE;
#endif
#ifdef UNLIT
    found = found || m.unlit != 0u;
#endif
    return found;
}

/// Two colours of 0 to 1 in one, by their roots in steps of 1/4095.
fn join(albedo: vec3f, glow: vec3f) -> vec3f {
    let low = round(4095.0 * sqrt(clamp(albedo, vec3f(0.0), vec3f(1.0))));
    let high = round(4095.0 * sqrt(clamp(glow, vec3f(0.0), vec3f(1.0))));
    return low + 4096.0 * high;
}

/// The first of them, then the second.
fn part(joined: vec3f) -> mat2x3f {
    let high = floor(joined / 4096.0);
    let low = joined - 4096.0 * high;
    return mat2x3f(low * low / (4095.0 * 4095.0), high * high / (4095.0 * 4095.0));
}

/// What is recorded in rgb of a colour that `base_color` gave.
fn recorded(m: Material, color: vec3f, p: Point, wide: Wide) -> vec3f {
#ifdef UNLIT
    if m.unlit != 0u {
        return join(vec3f(0.0), color);
    }
#endif
#ifdef EMISSION_MAPS
    if m.emission_texture != NO_TEXTURE {
        return join(color, read_texture(m.emission_texture, p, wide).rgb);
    }
#endif
    return color;
}
#endif

/// Row of `materials`; only where `is_lit`.
fn material_of(albedo: vec4f) -> u32 {
    return u32(max(abs(albedo.a), 1.0)) - 1u;
}

/// The albedo that was recorded.
fn albedo_of(albedo: vec4f) -> vec3f {
#ifdef GLOW
    if is_lit(albedo) && glows(materials[material_of(albedo)]) {
        return part(albedo.rgb)[0];
    }
#endif
    return albedo.rgb;
}

/// Radiance that leaves what was recorded by itself.
fn emission_of(albedo: vec4f) -> vec3f {
    let m = materials[material_of(albedo)];
    var light = select(vec3f(0.0), m.emission, albedo.a > 0.0);
#ifdef EMISSION_MAPS
    if m.emission_texture != NO_TEXTURE {
        light *= part(albedo.rgb)[1];
    }
#endif
    return light;
}

#ifdef UNLIT
/// The colour that a surface shows who looks at it, whatever lights it.
fn unlit_of(albedo: vec4f) -> vec3f {
    if is_lit(albedo) && materials[material_of(albedo)].unlit != 0u {
        return part(albedo.rgb)[1];
    }
    return vec3f(0.0);
}
#endif

/// What coordinates grow by to the next pixels. Call it in uniform control flow of a fragment entry only.
fn wide_of(p: Point) -> Wide {
    var wide: Wide;
#ifdef TEXTURES
#ifndef SHARP
    wide.uv = mat2x2f(dpdx(p.uv), dpdy(p.uv));
#ifdef SECOND_UVS
    wide.second_uv = mat2x2f(dpdx(p.second_uv), dpdy(p.second_uv));
#endif
#endif
#endif
    return wide;
}

#ifdef METALS
/// Roughness and metalness, recorded besides by graphs that show metals. Call it in uniform control flow of a fragment
/// entry only.
fn recorded_finish(material: u32, p: Point) -> vec2f {
    return finish(materials[material], p, wide_of(p));
}
#endif

/// The two texels of a surface.
struct Record {
    albedo: vec4f,
    normal: vec4f,
}

/// Records a point `depth` metres along the ray. Call it in uniform control flow of a fragment entry only: where
/// nothing is there, it ends.
fn record(material: u32, p: Point, normal: vec3f, depth: f32, front: bool) -> Record {
    let m = materials[material];
    let wide = wide_of(p);
    let found = base_color(m, p, wide);
#ifdef MASKS
    if is_hole(m, found.a) {
        discard;
    }
#endif
    var color = albedo_at(m, found.rgb, p, wide);
#ifdef GLOW
    color = recorded(m, color, p, wide);
#endif
    let n = bent_normal(m, normal, p, wide);
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
#ifdef SMOOTH
    /// Sine of the angle between its normal and that of the triangle, at most.
    deviation: f32,
#endif
#ifdef METALS
    roughness: f32,
    metallic: f32,
#endif
#ifdef FACES
    /// Reflectance of its face, if it is no metal: head on, and in w at grazing angles.
    face: vec4f,
#endif
#ifdef COATS
    /// Share and roughness of the clear layer, and its unit normal.
    coat: vec2f,
    coat_normal: vec3f,
#endif
#ifdef CLEAR
    /// Share of matte light that goes through instead.
    transmission: f32,
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
    let row = material_of(albedo);
    let m = materials[row];
    var s: Surface;
    s.position = origin + normal.w * direction;
    s.normal = normal.xyz;
    s.view = -direction;
    s.albedo = albedo_of(albedo);
    s.emission = emission_of(albedo);
    s.material = row;
    s.specular = m.specular;
    s.shininess = m.shininess;
#ifdef SMOOTH
    s.deviation = m.normal_deviation;
#endif
#ifdef METALS
    let mean = mean_finish(m);
    s.roughness = mean.x;
    s.metallic = mean.y;
#endif
#ifdef FACES
    s.face = mean_face(m);
#endif
#ifdef COATS
    // As bent as what lies below it.
    s.coat = mean_coat(m);
    s.coat_normal = s.normal;
#endif
    return s;
}
