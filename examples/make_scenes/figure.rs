//! A standing person in a long robe, a staff in one hand and a bowl in the other, out of swept parts.

use crate::mesh::TriangleMesh;
use crate::shapes::{around, ellipsoid, lathe, smooth_profile, surface, tube};
use glam::{DAffine3, DVec3};

/// One cross-section of the body: an ellipse whose edge carries the folds of the cloth. Metres.
struct CrossSection {
    height: f64,
    half_width: f64,
    half_depth: f64,
    /// How far the body leans forward here.
    forward: f64,
    /// How far a fold stands out.
    fold: f64,
}

const BODY: [CrossSection; 17] = [
    section(0.00, 0.300, 0.260, 0.020, 0.026),
    section(0.03, 0.306, 0.266, 0.020, 0.028),
    section(0.20, 0.270, 0.226, 0.015, 0.026),
    section(0.42, 0.242, 0.196, 0.015, 0.021),
    section(0.66, 0.222, 0.176, 0.010, 0.015),
    section(0.88, 0.206, 0.162, 0.000, 0.008),
    section(1.00, 0.186, 0.146, 0.000, 0.004),
    section(1.08, 0.160, 0.122, 0.000, 0.002),
    section(1.14, 0.160, 0.120, 0.005, 0.000),
    section(1.24, 0.182, 0.132, 0.015, 0.000),
    section(1.33, 0.200, 0.132, 0.010, 0.000),
    section(1.40, 0.200, 0.112, 0.000, 0.000),
    section(1.45, 0.160, 0.090, -0.005, 0.000),
    section(1.48, 0.092, 0.070, 0.000, 0.000),
    section(1.50, 0.060, 0.060, 0.005, 0.000),
    section(1.56, 0.054, 0.056, 0.015, 0.000),
    section(1.60, 0.000, 0.000, 0.020, 0.000),
];

const fn section(height: f64, half_width: f64, half_depth: f64, forward: f64, fold: f64) -> CrossSection {
    CrossSection { height, half_width, half_depth, forward, fold }
}

/// Faces +Z, stands on the floor, 1.75 m tall, the staff 2 m. `sides` is the number of columns round the body; the
/// rest follows it.
pub fn figure(sides: usize) -> TriangleMesh {
    let round = (sides / 2).max(8);
    let mut mesh = body(sides);
    mesh.add(head(round));
    // The right hand holds the staff out, the left one a bowl before the chest.
    mesh.add(arm(
        [DVec3::new(-0.185, 1.385, 0.0), DVec3::new(-0.31, 1.16, 0.02), DVec3::new(-0.36, 1.20, 0.25)],
        round,
    ));
    mesh.add(arm([DVec3::new(0.185, 1.385, 0.0), DVec3::new(0.275, 1.12, 0.03), DVec3::new(0.09, 1.15, 0.235)], round));
    mesh.add(staff(round).moved(DVec3::new(-0.37, 0.0, 0.29)));
    mesh.add(bowl(round).moved(DVec3::new(0.03, 1.17, 0.25)));
    mesh
}

fn body(sides: usize) -> TriangleMesh {
    let folds = 9.0;
    let skirt = surface(sides, BODY.len() - 1, true, |column, row| {
        let s = &BODY[row];
        let direction = around(column, sides);
        let angle = direction.y.atan2(direction.x);
        let out = 1.0 + s.fold * (folds * angle + 2.0 * s.height).cos() / s.half_width.max(1e-3);
        DVec3::new(direction.x * s.half_width * out, s.height, direction.y * s.half_depth * out + s.forward)
    });
    let belt = lathe(&[(0.165, 1.075), (0.180, 1.09), (0.180, 1.125), (0.165, 1.14)], sides)
        .transformed(DAffine3::from_scale(DVec3::new(0.96, 1.0, 0.74)));
    let mut mesh = skirt;
    mesh.add(belt);
    mesh
}

fn head(round: usize) -> TriangleMesh {
    let at = DVec3::new(0.0, 1.645, 0.025);
    let mut mesh = ellipsoid(at, DVec3::new(0.078, 0.112, 0.092), round, round);
    // Chin, nose and hair make it a face that looks somewhere.
    mesh.add(ellipsoid(at + DVec3::new(0.0, -0.072, 0.038), DVec3::new(0.046, 0.042, 0.046), round, round / 2));
    mesh.add(ellipsoid(at + DVec3::new(0.0, -0.008, 0.092), DVec3::new(0.014, 0.032, 0.019), 6, 4));
    mesh.add(ellipsoid(at + DVec3::new(0.0, 0.028, -0.022), DVec3::new(0.093, 0.106, 0.098), round, round));
    mesh.add(ellipsoid(at + DVec3::new(0.0, 0.03, -0.135), DVec3::new(0.05, 0.05, 0.05), round, round / 2));
    mesh
}

/// Shoulder, elbow and wrist; the sleeve widens towards its open end and a hand comes out of it.
fn arm([shoulder, elbow, wrist]: [DVec3; 3], round: usize) -> TriangleMesh {
    let along = |a: DVec3, b: DVec3, t: f64| a.lerp(b, t);
    let fore = (wrist - elbow).normalize();
    let sleeve_end = along(elbow, wrist, 0.82);
    let sleeve = [
        (shoulder + DVec3::new(0.0, 0.055, 0.0), 0.0),
        (shoulder + DVec3::new(0.0, 0.035, 0.0), 0.045),
        (shoulder, 0.066),
        (along(shoulder, elbow, 0.5), 0.062),
        (along(shoulder, elbow, 0.9), 0.060),
        (along(elbow, wrist, 0.12), 0.062),
        (along(elbow, wrist, 0.5), 0.068),
        (sleeve_end, 0.078),
        (sleeve_end + 0.004 * fore, 0.066),
        (along(elbow, wrist, 0.76), 0.0),
    ];
    let hand = [
        (along(elbow, wrist, 0.7), 0.0),
        (along(elbow, wrist, 0.72), 0.028),
        (wrist, 0.027),
        (wrist + 0.04 * fore, 0.040),
        (wrist + 0.075 * fore, 0.034),
        (wrist + 0.095 * fore, 0.0),
    ];
    let mut mesh = tube(&sleeve, round, false);
    mesh.add(tube(&hand, round, false));
    mesh
}

fn staff(round: usize) -> TriangleMesh {
    let mut mesh = lathe(&[(0.0, 0.0), (0.018, 0.0), (0.018, 1.94), (0.0, 1.94)], (round / 2).max(6));
    mesh.add(ellipsoid(DVec3::new(0.0, 1.97, 0.0), DVec3::splat(0.045), round, round / 2));
    mesh
}

fn bowl(round: usize) -> TriangleMesh {
    let outline = [(0.0, 0.0), (0.05, 0.0), (0.085, 0.035), (0.1, 0.075)];
    let mut profile = smooth_profile(&outline, 2);
    profile.extend([(0.092, 0.075), (0.05, 0.03), (0.0, 0.02)]);
    lathe(&profile, round)
}
