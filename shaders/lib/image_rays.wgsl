//! Rays of the first bounce, from surfaces that the image shows.
#define_import_path lightgraph::image_rays
#import lightgraph::cells::key_of
#import lightgraph::hit::look_from
#import lightgraph::ray_ends::end_on
#import lightgraph::rays::{Ray, pack}
#import lightgraph::surface::Surface
#import lightgraph::trace::leave
#ifdef ENVIRONMENT
#import lightgraph::rays::SKY
#import lightgraph::sky_rays::pack_sky
#import lightgraph::trace::FAR
#endif
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#endif

/// The end of a ray, with its cell's key.
fn end_of(s: Surface, direction: vec3f) -> Ray {
    let met = look_from(leave(s.position, s.normal + s.view), s.position, s.normal, direction);
    var end = Ray();
    if met.lit {
        end = end_on(met);
        end.cell = key_of(end.position, end.normal);
#ifdef LIGHTS
        end.lit = irradiance(end.position, end.normal, met.start);
#endif
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
