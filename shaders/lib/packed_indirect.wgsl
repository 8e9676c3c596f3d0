//! Light that a captured surface reflects from the packed probes round it: as `lightgraph::indirect` has it. With ALIKE
//! probes behind a surface or in a solid weigh as much as any, which needs neither where they are nor how open.
#define_import_path lightgraph::packed_indirect
#import lightgraph::packed_probes::{Weights, lambert, weigh}
#ifdef PROBE_VIEW
#import lightgraph::probe_view
#endif
#import lightgraph::probes
#import lightgraph::surface::{Record, albedo_of}
#ifdef SPECULAR
#import lightgraph::brdf::phong_weights
#import lightgraph::packed_probes::weights
#import lightgraph::surface::materials
#endif

/// All corners of a cell, for `gather`.
const ALL: u32 = 255u;

/// One probe's light in rgb, times its share in a: bit `i` of what sees a surface.
fn one(w: Weights, here: probes::Cell, i: u32, point: vec3f, normal: vec3f, behind: f32, sight: u32) -> vec4f {
    var probe = probes::probe_at(here, i & 7u);
    var share = probes::share_of(here, i & 7u);
#ifdef PROBE_VISIBILITY
    // Beyond the corners: the one that is nearest, alone.
    probe = select(probe, probes::near_probe(here, sight & 63u), vec3(i == 8u));
    share = select(share, 1.0, i == 8u);
#endif
    let found = weigh(w, probe);
#ifndef ALIKE
    let offset = probes::position(probe) - point;
    let cosine = dot(offset, normal) * inverseSqrt(max(dot(offset, offset), 1e-12));
    share *= max(cosine, behind);
#ifndef PROBE_VISIBILITY
    share *= max(found.open, behind);
#endif
#endif
    return vec4f(share * found.light, share);
}

/// As `lightgraph::probes::gather`, or `lightgraph::visible_probes::gather` with PROBE_VISIBILITY. `sight` says what
/// counts, as `lightgraph::visible_probes::sight` does.
///
/// A round for each probe that counts, not for each that might: on SIMD lanes what a branch leaves out takes its time
/// too.
fn gather(w: Weights, here: probes::Cell, point: vec3f, normal: vec3f, behind: f32, sight: u32) -> vec3f {
#ifdef PROBE_VISIBILITY
    var left = select(sight, 256u, sight >= 256u);
#else
    var left = sight & probes::corners_with_share(here);
#endif
    var sum = vec4f(0.0);
    while left != 0u {
        sum += one(w, here, firstTrailingBit(left), point, normal, behind, sight);
        left &= left - 1u;
    }
    return sum.rgb / max(sum.a, 1e-30);
}

/// The same round a point, of all grids that there are.
fn gather_round(w: Weights, point: vec3f, normal: vec3f, behind: f32, sight: u32) -> vec3f {
#ifdef PROBE_VIEW
    let near = probe_view::share(point);
    var mean = vec3f(0.0);
    for (var grid = 0u; grid < select(1u, 2u, near > 0.0); grid++) {
        var here = probes::cell(point);
        if grid == 1u {
            here = probes::near_cell(point);
        }
        let light = gather(w, here, point, normal, behind, sight);
        mean = mix(light, mix(mean, light, near), f32(grid));
    }
    return mean;
#else
    return gather(w, probes::cell(point), point, normal, behind, sight);
#endif
}

/// Radiance that the recorded surface on the ray from `eye` along `ray` reflects back.
fn reflected_probes(r: Record, eye: vec3f, ray: vec3f, behind: f32, sight: u32) -> vec3f {
    let point = eye + r.normal.w * ray;
    var sum = albedo_of(r.albedo) * gather_round(lambert(r.normal.xyz), point, r.normal.xyz, behind, sight);
#ifdef SPECULAR
    let row = u32(max(abs(r.albedo.a), 1.0)) - 1u;
    let specular = materials[row].specular;
    if specular > 0.0 {
        let w = weights(phong_weights(reflect(ray, r.normal.xyz), materials[row].shininess));
        sum += specular * gather_round(w, point, r.normal.xyz, behind, sight);
    }
#endif
    return sum;
}
