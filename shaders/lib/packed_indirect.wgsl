//! Light that a captured surface reflects from the packed probes round it: as `lightgraph::indirect` has it.
#define_import_path lightgraph::packed_indirect
#import lightgraph::packed_probes::{Weights, lambert, weigh}
#import lightgraph::probes
#import lightgraph::surface::Record
#ifdef PROBE_VISIBILITY
#import lightgraph::visible_probes
#endif
#ifdef SPECULAR
#import lightgraph::brdf::phong_weights
#import lightgraph::packed_probes::weights
#import lightgraph::surface::materials
#endif

/// One corner's light in rgb, times its share in a.
fn corner(packed: texture_3d<u32>, w: Weights, here: probes::Cell, i: u32, point: vec3f, normal: vec3f, behind: f32) -> vec4f {
    let probe = probes::probe_at(here, i);
    let found = weigh(packed, w, probe);
#ifdef PROBE_VISIBILITY
    let share = visible_probes::visible_share(here, i, point, normal, behind);
#else
    let offset = probes::position(probe) - point;
    let cosine = dot(offset, normal) * inverseSqrt(max(dot(offset, offset), 1e-12));
    let share = probes::share_of(here, i) * max(cosine, behind) * max(found.open, behind);
#endif
    return vec4f(share * found.light, share);
}

/// As `lightgraph::probes::gather`; with PROBE_VISIBILITY as `lightgraph::visible_probes::gather`.
fn gather(packed: texture_3d<u32>, w: Weights, point: vec3f, normal: vec3f, behind: f32) -> vec3f {
    let here = probes::cell(point);
    // Corners at whose side an axis has no share, as outside the probes, are left out: the others are the subsets of `sides`.
    let sides = dot(select(vec3u(0u), vec3u(1u, 2u, 4u), here.fraction > vec3f(0.0)), vec3u(1u));
    var sum = vec4f(0.0);
    var i = 0u;
    loop {
        sum += corner(packed, w, here, i, point, normal, behind);
        i = (i - sides) & sides;
        if i == 0u {
            break;
        }
    }
#ifdef PROBE_VISIBILITY
    if sum.a < visible_probes::NONE {
        let found = visible_probes::nearest_visible(here, point, normal);
        return select(vec3f(0.0), weigh(packed, w, found.xyz).light, found.w == 1u);
    }
#endif
    return sum.rgb / sum.a;
}

/// Radiance that the recorded surface on the ray from `eye` along `ray` reflects back.
fn reflected_probes(packed: texture_3d<u32>, r: Record, eye: vec3f, ray: vec3f, behind: f32) -> vec3f {
    let point = eye + r.normal.w * ray;
    var sum = r.albedo.rgb * gather(packed, lambert(r.normal.xyz), point, r.normal.xyz, behind);
#ifdef SPECULAR
    let row = u32(max(abs(r.albedo.a), 1.0)) - 1u;
    let specular = materials[row].specular;
    if specular > 0.0 {
        let w = weights(phong_weights(reflect(ray, r.normal.xyz), materials[row].shininess));
        sum += specular * gather(packed, w, point, r.normal.xyz, behind);
    }
#endif
    return sum;
}
