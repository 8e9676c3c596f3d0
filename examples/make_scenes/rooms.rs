//! The small scenes: a Cornell box and those for which light has a closed form.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{block, ellipsoid, standing_block, surface};
use glam::{DAffine3, DVec3};

/// The albedos of the classical box.
const WHITE: [f64; 3] = [0.73, 0.73, 0.73];
const RED: [f64; 3] = [0.63, 0.065, 0.05];
const GREEN: [f64; 3] = [0.14, 0.45, 0.091];

/// The plane alone has no height; probes need a box with a volume.
pub const PLANE_SCENE: &str = r#"// A plane has no height of its own: the probes' box reaches past the light.
Scene(
    gltf: "lambert_plane.glb",
    grid: ((-10.0, 0.0, -10.0), (10.0, 2.0, 10.0)),
)
"#;

/// Probes at the corners of a box round the balls: what lights them comes from afar, so that light between probes is
/// near to linear.
pub const BALLS_SCENE: &str = r#"// Probes stand round the balls, none in them.
Scene(
    gltf: "metal_balls.glb",
    grid: ((-2.7, 2.2, -1.0), (2.7, 3.8, 1.0)),
)
"#;

/// The same balls with Phong lobes beside a matte share.
pub const PHONG_BALLS: &str = r#"// The balls with Phong lobes of four exponents.
Scene(
    gltf: "metal_balls.glb",
    grid: ((-2.7, 2.2, -1.0), (2.7, 3.8, 1.0)),
    materials: {
        "metal 0.3": (specular: 0.04, shininess: 24),
        "metal 0.5": (specular: 0.04, shininess: 12),
        "metal 0.75": (specular: 0.04, shininess: 5),
        "metal 1": (specular: 0.04, shininess: 2),
    },
)
"#;

/// Roughness of the metal balls, from left to right.
const ROUGHNESS: [f64; 4] = [0.3, 0.5, 0.75, 1.0];

/// Four metal balls in the middle of a room whose walls give light of their own colour and reflect none.
pub fn metal_balls() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let (x, y, z) = (4.0, 6.0, 4.0);
    let walls = [
        ("floor", [0.15, 0.13, 0.1], [p(-x, 0.0, z), p(x, 0.0, z), p(x, 0.0, -z), p(-x, 0.0, -z)]),
        ("ceiling", [1.0, 0.95, 0.85], [p(-x, y, -z), p(x, y, -z), p(x, y, z), p(-x, y, z)]),
        ("back", [0.3, 0.3, 0.35], [p(-x, 0.0, -z), p(x, 0.0, -z), p(x, y, -z), p(-x, y, -z)]),
        ("front", [0.5, 0.55, 0.5], [p(x, 0.0, z), p(-x, 0.0, z), p(-x, y, z), p(x, y, z)]),
        ("left", [0.9, 0.25, 0.15], [p(-x, 0.0, z), p(-x, 0.0, -z), p(-x, y, -z), p(-x, y, z)]),
        ("right", [0.15, 0.35, 0.9], [p(x, 0.0, -z), p(x, 0.0, z), p(x, y, z), p(x, y, -z)]),
    ];
    for (name, radiance, corners) in walls {
        let material = document.emissive(name, [0.0; 3], radiance);
        let mut mesh = TriangleMesh::new();
        mesh.quad(corners);
        document.fixture(name, &mesh, material);
    }
    for (i, roughness) in ROUGHNESS.into_iter().enumerate() {
        let material = document.metal(&format!("metal {roughness}"), [0.95, 0.75, 0.5], roughness);
        let ball = ellipsoid(DVec3::ZERO, DVec3::splat(0.45), 64, 32);
        let mesh = document.mesh(&format!("ball {roughness}"), &[(&ball, material)]);
        document.place("ball", mesh, DAffine3::from_translation(p(1.2 * i as f64 - 1.8, 3.0, 0.0)));
    }
    document.camera("front", p(0.0, 3.0, 3.9), p(0.0, 3.0, 0.0), 68.0);
    document
}

/// A box of 2 m, open at +Z, with two blocks and a point light.
pub fn cornell() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let white = document.matte("white", WHITE);
    let red = document.matte("red", RED);
    let green = document.matte("green", GREEN);
    let p = DVec3::new;
    let walls = [
        ("floor", white, [p(-1.0, 0.0, 1.0), p(1.0, 0.0, 1.0), p(1.0, 0.0, -1.0), p(-1.0, 0.0, -1.0)]),
        ("ceiling", white, [p(-1.0, 2.0, -1.0), p(1.0, 2.0, -1.0), p(1.0, 2.0, 1.0), p(-1.0, 2.0, 1.0)]),
        ("back", white, [p(-1.0, 0.0, -1.0), p(1.0, 0.0, -1.0), p(1.0, 2.0, -1.0), p(-1.0, 2.0, -1.0)]),
        ("left", red, [p(-1.0, 0.0, 1.0), p(-1.0, 0.0, -1.0), p(-1.0, 2.0, -1.0), p(-1.0, 2.0, 1.0)]),
        ("right", green, [p(1.0, 0.0, -1.0), p(1.0, 0.0, 1.0), p(1.0, 2.0, 1.0), p(1.0, 2.0, -1.0)]),
    ];
    for (name, material, corners) in walls {
        let mut mesh = TriangleMesh::new();
        mesh.quad(corners);
        document.fixture(name, &mesh, material);
    }
    for (name, size, x, z, degrees) in [
        ("short", DVec3::new(0.6, 0.6, 0.6), 0.35, 0.35, -17.0_f64),
        ("tall", DVec3::new(0.6, 1.2, 0.6), -0.35, -0.3, 17.0),
    ] {
        let mesh = document.mesh(name, &[(&standing_block(0.0, 0.0, size), white)]);
        let turn = DAffine3::from_rotation_y(degrees.to_radians());
        document.place(name, mesh, DAffine3::from_translation(DVec3::new(x, 0.0, z)) * turn);
    }
    document.point_light("lamp", p(0.0, 1.65, 0.1), 6.0);
    document.camera("front", p(0.0, 1.0, 4.4), p(0.0, 1.0, 0.0), 36.0);
    document
}

/// A closed room whose walls all give off radiance 1 and reflect `albedo`: radiance is 1 / (1 − albedo) everywhere.
pub fn furnace(albedo: f64) -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let wall = document.emissive("wall", [albedo; 3], [1.0; 3]);
    let room = block(DVec3::new(-1.0, 0.0, -1.5), DVec3::new(1.0, 2.0, 1.5)).inside_out();
    document.fixture("room", &room, wall);
    document.camera("inside", DVec3::new(0.6, 1.3, 1.2), DVec3::new(-0.2, 0.9, -1.0), 60.0);
    document
}

/// A closed room of albedo 0.5 with a point light of 10 cd: the mean outgoing radiance is known whatever the shape.
pub fn empty_room() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let wall = document.matte("wall", [0.5; 3]);
    let room = block(DVec3::new(-2.0, 0.0, -2.5), DVec3::new(2.0, 3.0, 2.5)).inside_out();
    document.fixture("room", &room, wall);
    document.point_light("lamp", DVec3::new(0.3, 2.0, -0.4), 10.0);
    document.camera("inside", DVec3::new(1.6, 1.6, 2.2), DVec3::new(-0.6, 1.2, -1.5), 65.0);
    document
}

/// Two sealed rooms of 2 m; the wall between them is 4 mm thick. The light is in the left one: the right one is black.
pub fn two_rooms() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let white = document.matte("white", WHITE);
    let half_wall = 0.002;
    for (name, side) in [("lit_room", -1.0_f64), ("dark_room", 1.0)] {
        let (near, far) = (side * half_wall, side * (half_wall + 2.0));
        let (min, max) = (DVec3::new(near.min(far), 0.0, -1.0), DVec3::new(near.max(far), 2.0, 1.0));
        document.fixture(name, &block(min, max).inside_out(), white);
        let x = side * 1.0;
        let block = standing_block(x, -0.2, DVec3::new(0.5, 0.7, 0.5));
        document.fixture(&format!("{name}_block"), &block, white);
    }
    document.point_light("lamp", DVec3::new(-1.0, 1.7, 0.2), 1.5);
    for (name, side) in [("lit", -1.0), ("dark", 1.0)] {
        let eye = DVec3::new(side * 1.8, 1.2, 0.8);
        document.camera(name, eye, DVec3::new(side * 0.4, 0.8, -0.5), 65.0);
    }
    document
}

/// A point light of 10 cd, 1 m above a plane of albedo 0.5 that fills the image: L = albedo/π · I · cosθ / d².
pub fn lambert_plane() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let gray = document.matte("plane", [0.5; 3]);
    let plane = surface(4, 4, false, |x, z| DVec3::new(5.0 * x as f64 - 10.0, 0.0, 10.0 - 5.0 * z as f64));
    document.fixture("plane", &plane, gray);
    document.point_light("lamp", DVec3::new(0.0, 1.0, 0.0), 10.0);
    document.camera("above", DVec3::new(0.0, 3.0, 2.5), DVec3::ZERO, 40.0);
    document
}
