//! Scenes under the sky: none of them holds a light.

use crate::glb::GlbBuilder;
use crate::mesh::TriangleMesh;
use crate::shapes::{ellipsoid, standing_block};
use glam::DVec3;

/// A matte ball that nothing but the sky lights. Under a uniform sky of radiance 1 it shows its albedo.
pub fn sky_ball() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let gray = document.matte("gray", [0.8, 0.5, 0.2]);
    document.fixture("ball", &ellipsoid(DVec3::ZERO, DVec3::ONE, 96, 48), gray);
    document.camera("front", DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, 40.0);
    document
}

pub const BALL_SCENE: &str = "\
// A uniform sky of radiance 1; the probes stand outside of the ball, but for eight.
Scene(
    gltf: \"sky_ball.glb\",
    grid: ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0)),
    environment: Constant(radiance: (1.0, 1.0, 1.0)),
)
";

/// A yard with walls, blocks and a ball, without a light or a camera.
pub fn yard() -> GlbBuilder {
    let mut document = GlbBuilder::new();
    let stone = document.matte("stone", [0.55, 0.52, 0.48]);
    let brick = document.matte("brick", [0.52, 0.22, 0.15]);
    let white = document.matte("white", [0.75, 0.75, 0.75]);
    let leaf = document.matte("leaf", [0.15, 0.35, 0.1]);
    let p = DVec3::new;
    let mut ground = TriangleMesh::new();
    ground.quad([p(-6.0, 0.0, 6.0), p(6.0, 0.0, 6.0), p(6.0, 0.0, -6.0), p(-6.0, 0.0, -6.0)]);
    document.fixture("ground", &ground, stone);
    let mut walls = standing_block(0.0, -4.0, p(8.0, 2.5, 0.4));
    walls.add(standing_block(-4.0, -1.6, p(0.4, 2.5, 4.4)));
    document.fixture("walls", &walls, brick);
    let mut blocks = standing_block(-1.6, -1.2, p(1.2, 1.2, 1.2));
    blocks.add(standing_block(1.8, -2.2, p(1.0, 2.0, 1.0)));
    document.fixture("blocks", &blocks, white);
    document.fixture("ball", &ellipsoid(p(0.6, 0.7, 0.8), DVec3::splat(0.7), 32, 16), leaf);
    document
}

pub const YARD_SCENE: &str = "\
// The yard in the evening: a low sun, its sky, and a lamp on the wall.
Scene(
    gltf: \"yard.glb\",
    grid: ((-6.0, 0.0, -6.0), (6.0, 3.0, 6.0)),
    lights: {
        \"sun\": Sun(azimuth: 100, elevation: 12, lux: 3, color: (1.0, 0.75, 0.5)),
        \"lamp\": Point(at: (-3.5, 2.2, -3.5), candela: 4, color: (1.0, 0.8, 0.5)),
    },
    cameras: {
        \"gate\": (at: (2.5, 1.7, 6.5), look_at: (-0.6, 0.9, -1.5), fov: 45),
        \"corner\": (at: (-3.0, 3.5, 4.5), look_at: (0.5, 0.5, -1.0)),
    },
    environment: Sky(turbidity: 3),
    camera: \"gate\",
)
";
