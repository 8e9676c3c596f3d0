//! Where rays end, with the light that arrives there from the scene's lights.
#define_import_path lightgraph::lit_ray_ends
#import lightgraph::hit::Met
#import lightgraph::ray_ends::end_on
#import lightgraph::rays::Ray
#ifdef LIGHTS
#import lightgraph::irradiance::irradiance
#endif

/// The end of a ray on a surface that light leaves; without a cell.
fn lit_end_on(met: Met) -> Ray {
    var end = end_on(met);
#ifdef LIGHTS
    let arriving = irradiance(met.surface, met.start);
    end.lit = arriving.seen;
#ifdef GGX
    end.evenly = log2(max(dot(arriving.evenly, vec3f(1.0)), 1e-20) / max(dot(arriving.seen, vec3f(1.0)), 1e-20));
#endif
#endif
    return end;
}
