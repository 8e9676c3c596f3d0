//! The harmonics of glossy lobes, from a table: `lobe_table.wgsl` makes it of the functions in `gloss`.
//!
//! A lobe is its own mirror image in the plane of incidence. Degree l of such a function is a sum of l + 1 radially
//! symmetric ones round directions in that plane, evenly apart over half a circle; ORDER + 1 directions will do for
//! every degree, so that a lobe is turned by turning them. Texel (l * (ORDER + 1) + j, ANGLES * material + angle) holds
//! degree l round direction j, for each of the three lobes, at an angle between normal and viewer.
#define_import_path lightgraph::lobe_table
#import lightgraph::brdf::lambert_factor
#import lightgraph::gloss::{matte, shines, tints}
#import lightgraph::sh::{COUNT, ORDER, harmonic}
#import lightgraph::surface::Surface

/// Directions in the plane of incidence.
const DIRECTIONS: u32 = ORDER + 1u;
/// Angles to the viewer, from 0 to a right angle.
const ANGLES: u32 = 48u;

var lobe_table: texture_2d<f32>;

/// Direction number `j` in the plane, from the unit `normal` towards the viewer's side by the unit `tangent`.
fn plane_direction(j: u32, normal: vec3f, tangent: vec3f) -> vec3f {
    let angle = 3.14159265359 * f32(j) / f32(DIRECTIONS);
    return cos(angle) * normal + sin(angle) * tangent;
}

/// Puts into `sum` the weights of the coefficients in the radiance that a surface reflects towards its viewer, matte
/// and glossy together.
///
/// How many degrees there are is asked of the table, though it is known: so that loops stay loops. Unrolled, and with
/// every weight a value of its own, degree 6 keeps a software driver's compiler busy for twenty seconds, degree 10 for
/// minutes.
fn weights(s: Surface, sum: ptr<function, array<vec3f, COUNT>>) {
    let degrees = u32(sqrt(f32(textureDimensions(lobe_table).x)) + 0.5);
    let cosine = clamp(dot(s.view, s.normal), 0.0, 1.0);
    let across = s.view - dot(s.view, s.normal) * s.normal;
    // Seen along the normal a lobe is round it, and any tangent will do.
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(s.normal.x) > 0.7);
    let seen_across = dot(across, across) > 1e-8;
    let tangent = normalize(select(cross(s.normal, other), across, seen_across));

    let at = acos(cosine) / 1.57079632679 * f32(ANGLES - 1u);
    let low = min(u32(at), ANGLES - 2u);
    let row = s.material * ANGLES + low;
    let directions = select(0u, degrees, shines(s));
    let tint = tints(s);
    let albedo = matte(s);
    for (var l = 0u; l < degrees; l++) {
        let first = l * l;
        let lambert = albedo * lambert_factor(l);
        for (var k = 0u; k < 2u * l + 1u; k++) {
            (*sum)[first + k] = lambert * harmonic(l, k, s.normal);
        }
        for (var j = 0u; j < directions; j++) {
            let column = l * degrees + j;
            let below = textureLoad(lobe_table, vec2u(column, row), 0).rgb;
            let above = textureLoad(lobe_table, vec2u(column, row + 1u), 0).rgb;
            let share = tint * mix(below, above, at - f32(low));
            let direction = plane_direction(j, s.normal, tangent);
            for (var k = 0u; k < 2u * l + 1u; k++) {
                (*sum)[first + k] += share * harmonic(l, k, direction);
            }
        }
    }
}
