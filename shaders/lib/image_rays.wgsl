//! Rays of the first bounce, from surfaces that the image shows.
#define_import_path lightgraph::image_rays
#import lightgraph::cells::key_of
#import lightgraph::hit::look_from
#import lightgraph::lit_ray_ends::lit_end_on
#import lightgraph::rays::{Ray, pack}
#import lightgraph::surface::Surface
#import lightgraph::trace::leave
#ifdef ENVIRONMENT
#import lightgraph::rays::SKY
#import lightgraph::sky_rays::pack_sky
#import lightgraph::trace::FAR
#endif

/// The end of a ray, with its cell's key.
fn end_of(s: Surface, direction: vec3f) -> Ray {
    let met = look_from(leave(s.position, s.normal + s.view), s.position, s.normal, direction);
    var end = Ray();
    if met.lit {
        end = lit_end_on(met);
        end.cell = key_of(end.position, end.normal);
    } else {
        // Where nothing is met the way it went, as if from far away.
        end.position = s.position + min(met.distance, 1e4) * direction;
        end.normal = -direction;
        end.flat_normal = -direction;
#ifdef ENVIRONMENT
        end.cell = select(0u, SKY, met.distance >= FAR);
#endif
    }
    return end;
}

fn pack_end(end: Ray) -> array<vec4u, 2> {
#ifdef ENVIRONMENT
    if end.cell == SKY {
        return pack_sky(end.position, -end.normal);
    }
#endif
    return pack(end);
}
