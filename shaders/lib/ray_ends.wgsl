//! Where rays end, as they are kept.
#define_import_path lightgraph::ray_ends
#import lightgraph::gloss::mean_albedo
#import lightgraph::hit::{Met, flat_side}
#import lightgraph::rays::Ray

/// The end of a ray on a surface that light leaves; without a cell and without light.
fn end_on(met: Met) -> Ray {
    var end = Ray();
    end.position = met.surface.position;
    end.normal = met.surface.normal;
    end.flat_normal = flat_side(met);
    end.albedo = mean_albedo(met.surface);
    return end;
}
