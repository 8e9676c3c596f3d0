//! Whether a scene is a room, and where a person would stand in it; or from which side to look at it.

use super::{
    clusters::{Cluster, triangles},
    model::{Bounds, Scene},
    transforms::Transforms,
};
use glam::Vec3;
use std::f32::consts::TAU;

/// A place inside of a room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stand {
    /// Where a person's eyes are, metres.
    pub eye: Vec3,
    /// Unit, level: where there is most to see.
    pub forward: Vec3,
    /// Whether next to no light comes in from outside.
    pub closed: bool,
    /// Where a lamp would hang.
    pub lamp: Vec3,
    /// How far walls, floor and ceiling are from the lamp, on average.
    pub reach: f32,
}

/// Directions that a place is judged by.
const LOOKS: usize = 64;
/// Directions along the horizon.
const TURNS: usize = 32;
/// Share of what is seen that must be the fronts of surfaces, on average over the places tried: the rest may be an open
/// side, or the sky over a court.
const ENCLOSED: f32 = 0.75;
/// Share that may be backs: inside of a solid there is nothing else.
const BACKS: f32 = 0.1;
/// Share of backs from which on a place lies within a solid.
const BURIED: f32 = 0.9;
/// Share that may be open where a room counts as closed.
const OPEN: f32 = 0.03;
/// Metres: a person fits into what is higher and wider.
const ROOM_SIZE: f32 = 2.0;
/// Metres from the floor.
const EYE_HEIGHT: f32 = 1.6;
/// Clusters that have a box together.
const GROUP: usize = 16;

/// What a ray met.
#[derive(Clone, Copy)]
struct Met {
    distance: f32,
    front: bool,
}

/// What is seen from a place, as shares of all directions, and the mean distance.
struct Seen {
    fronts: f32,
    backs: f32,
    reach: f32,
}

struct Surroundings<'a> {
    scene: &'a Scene,
    nodes: Transforms,
    /// A box round each [`GROUP`] of clusters, and round each of these.
    groups: Vec<(Bounds, Vec<(Bounds, Cluster)>)>,
    all: Bounds,
}

/// Towards whom looks at a scene from outside: the first unless it shows backs alone.
const SIDES: [Vec3; 6] = [
    FROM_FRONT,
    Vec3::new(0.0, 0.3, -1.0),
    Vec3::new(1.0, 0.3, 0.0),
    Vec3::new(-1.0, 0.3, 0.0),
    Vec3::new(0.0, -1.0, 0.3),
    Vec3::new(0.0, 1.0, 0.3),
];
/// From +Z, a little above.
pub(super) const FROM_FRONT: Vec3 = Vec3::new(0.0, 0.3, 1.0);
/// Share of the area turned to a side that must be fronts: of a solid it is half, of a wall seen from behind none.
const FRONTS: f32 = 0.1;

/// The side from which a scene shows the most fronts, where +Z shows next to none.
pub(super) fn other_side(scene: &Scene) -> Option<Vec3> {
    let world = Surroundings::new(scene);
    let geometry = &scene.geometry;
    let mut fronts = [0.0; SIDES.len()];
    let mut all = 0.0;
    for triangle in 0..geometry.indices.len() / 3 {
        let [a, b, c] = world.corners(triangle);
        let area = (b - a).cross(c - a);
        let material = geometry.vertices[geometry.indices[3 * triangle] as usize].material;
        let both = scene.materials[material as usize].double_sided;
        for (front, side) in fronts.iter_mut().zip(SIDES) {
            let turned = area.dot(side);
            *front += if both { turned.abs() } else { turned.max(0.0) };
        }
        all += area.dot(FROM_FRONT).abs().max(area.length() * 0.1);
    }
    if fronts[0] >= FRONTS * all {
        return None;
    }
    let best = (0..SIDES.len()).max_by(|a, b| fronts[*a].total_cmp(&fronts[*b]))?;
    (best > 0).then(|| SIDES[best])
}

/// Where to stand; `None` for what is seen from outside.
pub(super) fn stand(scene: &Scene) -> Option<Stand> {
    let world = Surroundings::new(scene);
    let size = world.all.max - world.all.min;
    if size.min_element() <= 0.0 {
        return None;
    }
    let inside = |x: f32, y: f32, z: f32| world.all.min + Vec3::new(x, y, z) * size;
    let places: Vec<Vec3> =
        (0..25).map(|i| inside(0.1 + 0.2 * (i % 5) as f32, 0.45, 0.1 + 0.2 * (i / 5) as f32)).collect();
    let middle = inside(0.5, 0.45, 0.5);
    let tried = [middle].into_iter().chain(places.iter().step_by(4).copied());
    let seen: Vec<(Vec3, Seen)> = tried.map(|place| (place, world.seen(place))).collect();
    // Inside of solids nobody stands.
    let free: Vec<&(Vec3, Seen)> = seen.iter().filter(|(_, seen)| seen.backs <= BACKS).collect();
    let fronts = free.iter().map(|(_, seen)| seen.fronts).sum::<f32>();
    if 2 * free.len() < seen.len() || fronts < ENCLOSED * free.len() as f32 {
        return None;
    }
    let (best, most) = free.into_iter().max_by(|a, b| a.1.reach.total_cmp(&b.1.reach))?;
    let best = *best;
    let roomy = size.y >= ROOM_SIZE && size.x.min(size.z) >= ROOM_SIZE;
    // A thing that is turned inside out has places beside it.
    let beside = seen.iter().any(|(_, seen)| (BACKS..BURIED).contains(&seen.backs));
    if !roomy && (beside || world.backs_from_outside() <= 0.5) {
        return None;
    }
    let views = places.iter().filter_map(|place| world.view(*place));
    let (_, eye, forward) = views.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let above = world.met(best, Vec3::Y).map_or(0.0, |met| met.distance);
    Some(Stand {
        eye,
        forward,
        closed: most.fronts + most.backs >= 1.0 - OPEN,
        lamp: best + Vec3::Y * above * 0.7,
        reach: most.reach,
    })
}

/// Whether a scene that is no room shows backs alone, from wherever it is looked at.
pub(super) fn is_inside_out(scene: &Scene) -> bool {
    let rigid = scene.deformed.is_empty() && !scene.materials.iter().any(|m| m.double_sided);
    rigid && Surroundings::new(scene).backs_from_outside() >= BURIED
}

impl<'a> Surroundings<'a> {
    fn new(scene: &'a Scene) -> Surroundings<'a> {
        let nodes = scene.pose(0.0).nodes;
        let mut world = Surroundings { scene, nodes, groups: vec![], all: Bounds::EMPTY };
        let round = |c: &Cluster| Bounds::of(triangles(c).flat_map(|t| world.corners(t)));
        let boxed = |some: &[Cluster]| {
            let boxes: Vec<(Bounds, Cluster)> = some.iter().map(|c| (round(c), *c)).collect();
            (boxes.iter().fold(Bounds::EMPTY, |all, (b, _)| all.union(*b)), boxes)
        };
        world.groups = scene.geometry.clusters.chunks(GROUP).map(boxed).collect();
        world.all = world.groups.iter().fold(Bounds::EMPTY, |all, (b, _)| all.union(*b));
        world
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let geometry = &self.scene.geometry;
        [0, 1, 2].map(|corner| {
            let v = &geometry.vertices[geometry.indices[3 * triangle + corner] as usize];
            self.nodes[v.node as usize].transform_point3(v.position.into())
        })
    }

    /// What a ray along a unit direction meets first.
    fn met(&self, origin: Vec3, direction: Vec3) -> Option<Met> {
        let inverse = direction.recip();
        let mut best: Option<Met> = None;
        let end = |best: Option<Met>| best.map_or(f32::INFINITY, |met| met.distance);
        for (round, clusters) in &self.groups {
            if !enters(round, origin, inverse, end(best)) {
                continue;
            }
            for (round, cluster) in clusters {
                if enters(round, origin, inverse, end(best)) {
                    let found = triangles(cluster).filter_map(|t| meet(self.corners(t), origin, direction));
                    best = found.chain(best).min_by(|a, b| a.distance.total_cmp(&b.distance));
                }
            }
        }
        best
    }

    fn seen(&self, place: Vec3) -> Seen {
        let met: Vec<Met> = (0..LOOKS).filter_map(|i| self.met(place, spread(i))).collect();
        let share = |front: bool| met.iter().filter(|m| m.front == front).count() as f32 / LOOKS as f32;
        let reach = met.iter().map(|m| m.distance).sum::<f32>() / met.len().max(1) as f32;
        Seen { fronts: share(true), backs: share(false), reach }
    }

    /// Share of backs in what is seen from outside.
    fn backs_from_outside(&self) -> f32 {
        let (middle, far) = (self.all.center(), self.all.diagonal());
        let met: Vec<Met> = (0..LOOKS).filter_map(|i| self.met(middle - far * spread(i), spread(i))).collect();
        met.iter().filter(|m| !m.front).count() as f32 / met.len().max(1) as f32
    }

    /// How far one sees from above a place on the floor, the eye and the best direction.
    fn view(&self, place: Vec3) -> Option<(f32, Vec3, Vec3)> {
        let below = self.met(place, Vec3::NEG_Y).filter(|m| m.front)?.distance;
        let above = self.met(place, Vec3::Y).map_or(below, |m| m.distance);
        let eye = place + Vec3::Y * (EYE_HEIGHT.min(0.5 * (above + below)) - below);
        let turn = |i: usize| {
            let (sine, cosine) = (TAU * (i as f32 + 0.37) / TURNS as f32).sin_cos();
            Vec3::new(sine, 0.0, -cosine)
        };
        let met: Vec<Option<Met>> = (0..TURNS).map(|i| self.met(eye, turn(i))).collect();
        let backs = met.iter().flatten().filter(|m| !m.front).count();
        if backs as f32 > BACKS * TURNS as f32 {
            return None;
        }
        // Where nothing is there is nothing to see.
        let way = |i: usize| met[i % TURNS].map_or(0.0, |m| m.distance);
        // Sixty degrees round a direction, the middle counting most.
        let wide = |i: usize| (0..5).map(|k| [1.0, 2.0, 3.0, 2.0, 1.0][k] * way(i + TURNS + k - 2)).sum::<f32>() / 9.0;
        let best = (0..TURNS).max_by(|a, b| wide(*a).total_cmp(&wide(*b)))?;
        Some((wide(best), eye, turn(best)))
    }
}

/// Directions that cover the sphere evenly: a spiral by the golden angle.
fn spread(i: usize) -> Vec3 {
    let y = 1.0 - (2 * i + 1) as f32 / LOOKS as f32;
    let (sine, cosine) = (2.399_963_2 * i as f32).sin_cos();
    let across = (1.0 - y * y).sqrt();
    Vec3::new(across * cosine, y, across * sine)
}

fn enters(b: &Bounds, origin: Vec3, inverse: Vec3, end: f32) -> bool {
    let (low, high) = ((b.min - origin) * inverse, (b.max - origin) * inverse);
    let (near, far) = (low.min(high), low.max(high));
    near.max_element().max(0.0) <= far.min_element().min(end)
}

/// Source: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997.
fn meet([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<Met> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let from = (origin - a) / determinant;
    let q = from.cross(ab);
    let (u, v, distance) = (from.dot(p), direction.dot(q), ac.dot(q));
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0;
    inside.then_some(Met { distance, front: determinant > 0.0 })
}
