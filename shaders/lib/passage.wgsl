//! Light that goes straight through surfaces: where they are there in part, and where they transmit, as thin sheets do.
//! For graphs that follow paths.
#define_import_path lightgraph::passage
#import lightgraph::hit::{Met, describe, look}
#import lightgraph::random::next
#import lightgraph::trace::{FAR, NOTHING, REACH, closest_between}

/// Sheets that a ray goes through at most.
const SHEETS: u32 = 64u;

/// What of light from straight behind it leaves a surface towards who sees it.
fn through(met: Met) -> vec3f {
    var light = vec3f(0.0);
#ifdef FACES
    let s = met.surface;
    if s.transmission > 0.0 {
        let edge = pow(clamp(1.0 - abs(dot(s.normal, s.view)), 0.0, 1.0), 5.0);
        let head_on = max(max(s.face.r, s.face.g), s.face.b);
        let kept = 1.0 - mix(head_on, s.face.w, edge);
        light = s.transmission * (1.0 - s.metallic) * kept * s.albedo;
    }
#endif
    return vec3f(1.0 - met.there) + met.there * light;
}

/// What a ray meets that stops it: of what light goes through, it is chance that says. `carried` is what the path
/// carries.
fn look_on(origin: vec3f, direction: vec3f, carried: ptr<function, vec3f>, state: ptr<function, u32>) -> Met {
    var here = origin;
    var gone = 0.0;
    var met = look(here, direction);
    for (var i = 0u; i < SHEETS; i++) {
        if met.distance >= FAR || !met.lit && met.there > 0.0 {
            return met;
        }
        met.distance += gone;
        let light = through(met);
        let share = max(max(light.r, light.g), light.b);
        if share <= 0.0 {
            return met;
        }
        if next(state) >= share {
            *carried *= met.there / (1.0 - share);
            return met;
        }
        *carried *= light / share;
        gone = met.distance;
        here = met.beyond;
        met = look(here, direction);
    }
    met.lit = false;
    return met;
}

/// What of light from `end` metres away arrives at a ray's start.
fn free_share(start: vec3f, direction: vec3f, end: f32) -> vec3f {
    var share = vec3f(1.0);
    var here = start;
    var left = REACH * end;
    for (var i = 0u; i < SHEETS; i++) {
        let hit = closest_between(here, direction, 0.0, left);
        if hit.triangle == NOTHING {
            return share;
        }
        let met = describe(hit, here, direction, 0.0);
        if !met.lit && met.there > 0.0 {
            return vec3f(0.0);
        }
        share *= through(met);
        if all(share <= vec3f(0.0)) {
            return share;
        }
        here = met.beyond;
        left -= met.distance;
    }
    return vec3f(0.0);
}
