//! Draws and dispatches over many views, member by member: what each sees, so that each has a version of its own and only
//! those whose version is new run again. No device.

use super::ingredient::Kind;
use super::member::Members;
use super::sight::{covered, eye, meets_planes, planes};
use super::{
    Action, Binding, ColorTarget, DepthTarget, Desc, Draw, Frusta, Place, Plan, ResourceId, Sight, Step, TextureDesc,
};
use crate::image::Image;
use crate::scene::{Bounds, Column, Table, reach};
use crate::shader::Stage;
use crate::value::Value;
use glam::{Mat4, Vec3, Vec4};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

/// Whether some members of a draw can be drawn again while what the others drew stays: each has a tile or a layer of its own in
/// every target, all of which begin at their clear values.
pub fn splits(plan: &Plan, draw: &Draw) -> bool {
    let clears = |t: &ColorTarget| t.clear.is_some();
    let fresh = |t: &DepthTarget| t.clear.is_some() && t.write;
    let targets = || draw.color.iter().map(|t| t.resource).chain(draw.depth.iter().map(|t| t.resource));
    let room = |id: ResourceId, place: &Place| match (&plan.resources[id.0].desc, place) {
        (Desc::Texture(TextureDesc { tiles, .. }), Place::Rect(_)) => tiles.is_some(),
        (Desc::Texture(TextureDesc { layers, .. }), Place::Layer(layer)) => layer < layers,
        _ => false,
    };
    let places: BTreeSet<Place> = draw.members.iter().map(|m| m.place).collect();
    draw.views == 1
        && draw.color.iter().all(clears)
        && draw.depth.iter().all(fresh)
        && places.len() == draw.members.len()
        && targets().all(|id| places.iter().all(|p| room(id, p)))
}

/// Whether some members of a step that has any can run again while what the others made stays.
pub fn apart(plan: &Plan, step: &Step) -> bool {
    // What its checks say is said of all members together.
    let checked = step.bindings.iter().any(|b| matches!(b, Binding::Report));
    let places = match &step.action {
        Action::Draw(draw) => splits(plan, draw),
        Action::Compute { .. } | Action::Copy { .. } | Action::Clear { .. } => true,
    };
    places && !checked
}

/// What a step that can run member by member reads of the scene's places.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parts {
    /// Where each member's frustum is.
    pub frusta: Frusta,
    /// Resources of which each member reads what its frustum meets.
    pub resources: Vec<ResourceId>,
    /// The same of tables, by index of [`Plan::tables`].
    pub tables: Vec<usize>,
}

/// Tables that hold nothing but where the scene's triangles are, and what follows from it and the triangles themselves.
const PLACES: [&str; 4] = ["nodes", "clusters", "triangles", "bvh"];

/// `None` for a step that runs as a whole.
pub fn parts(plan: &Plan, step: &Step) -> Option<Parts> {
    let tables = |wanted: &str| {
        let bound = step.bindings.iter().filter_map(|b| if let Binding::Table(i) = b { Some(*i) } else { None });
        bound.filter(|i| plan.tables.get(*i).is_some_and(|t| t.table == wanted)).collect::<Vec<_>>()
    };
    let draw = match &step.action {
        Action::Draw(draw) => draw,
        Action::Compute { .. } | Action::Copy { .. } | Action::Clear { .. } => {
            let Sight { members: _, frusta, reads, depth: _ } = step.sight.as_ref().filter(|_| apart(plan, step))?;
            return Some(Parts {
                frusta: Frusta::Buffer(*frusta),
                resources: reads.iter().chain([frusta]).copied().collect(),
                tables: PLACES.iter().flat_map(|name| tables(name)).collect(),
            });
        }
    };
    let indirect = draw.indirect.filter(|_| apart(plan, step))?;
    let mut told = tables("nodes");
    // Where things are is known by the nodes; a shader that doesn't ask for them places things in its own way.
    if told.is_empty() {
        return None;
    }
    if let Frusta::Table(i) = indirect.frusta {
        told.extend(tables(&plan.tables.get(i)?.table));
    }
    Some(Parts { frusta: indirect.frusta, resources: vec![indirect.buffer], tables: told })
}

/// Where each member of a step puts what it makes, and the texture that all of them share.
fn places<'p>(plan: &'p Plan, step: &Step) -> Option<(Vec<Place>, &'p TextureDesc)> {
    let texture = |id: ResourceId| match &plan.resources.get(id.0)?.desc {
        Desc::Texture(t) => Some(t),
        Desc::Buffer { .. } => None,
    };
    if let Action::Draw(draw) = &step.action {
        let target = draw.depth.as_ref().map(|d| d.resource).or(draw.color.first().map(|t| t.resource))?;
        return Some((draw.members.iter().map(|m| m.place).collect(), texture(target)?));
    }
    let Sight { members, depth, .. } = step.sight.as_ref()?;
    let mut all = depth.iter().chain(&step.writes).filter_map(|id| texture(*id));
    let t = all.find(|t| t.tiles.map_or(t.layers, |tiles| tiles.count) == *members)?;
    let place = |i: u32| match t.tiles {
        Some(tiles) => {
            Place::Rect([i % tiles.columns * tiles.edge, i / tiles.columns * tiles.edge, tiles.edge, tiles.edge])
        }
        None => Place::Layer(i),
    };
    Some(((0..*members).map(place).collect(), t))
}

/// The steps of a plan that run member by member, by index.
pub type Apart = BTreeMap<usize, Parts>;

/// They are many members to look at: once a plan.
pub fn steps_apart(plan: &Plan) -> Apart {
    plan.steps.iter().enumerate().filter_map(|(index, step)| Some((index, parts(plan, step)?))).collect()
}

/// What the members of a step see.
#[derive(Debug, Clone)]
pub struct Seen {
    /// By member: a version of it.
    pub versions: Members,
    views: Arc<Vec<View>>,
    /// The buffer of frusta that the views are of.
    frusta: Option<Arc<Vec<Mat4>>>,
    world: Arc<World>,
    /// Those that the world is of.
    tables: Vec<Table>,
}

/// What a member is told of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
struct View {
    /// World to clip space.
    frustum: Mat4,
    /// The content of its row in a table of frusta; 0 for a buffer of them. Of a dispatch how far the scene reaches: the
    /// boxes of all triangles are as much wider as rays may be off.
    row: u64,
}

/// By step that runs member by member, what each of its members sees. `known` gives the frusta in a buffer;
/// steps whose frusta it doesn't know are left out. What was seen `before` is handed on where nothing has moved since, and saves time where
/// little has.
pub fn seen(
    plan: &Plan,
    apart: &Apart,
    tables: &[Table],
    known: impl Fn(ResourceId) -> Option<Arc<Vec<Mat4>>>,
    before: &BTreeMap<usize, Seen>,
) -> BTreeMap<usize, Seen> {
    let mut all = BTreeMap::new();
    let of: Vec<Table> = tables.iter().filter(|t| WORLD.contains(&t.name)).cloned().collect();
    let same = |seen: &&Seen| seen.tables.len() == of.len() && seen.tables.iter().zip(&of).all(|(a, b)| a.is_clone(b));
    let known_world = before.values().find(same).map(|seen| seen.world.clone());
    let earlier = before.values().next().map(|seen| (&*seen.world, seen.tables.as_slice()));
    let Some(world) = known_world.or_else(|| World::after(tables, earlier).map(Arc::new)) else { return all };
    for (&index, parts) in apart {
        let Some(step) = plan.steps.get(index) else { continue };
        let (rows, reach): (Vec<usize>, u64) = match (&step.action, &step.sight) {
            (Action::Draw(draw), _) => (draw.members.iter().map(|m| m.index as usize).collect(), 0),
            (_, Some(sight)) => ((0..sight.members as usize).collect(), world.reach()),
            (_, None) => continue,
        };
        let rows = rows.into_iter();
        // What is not a number sees everything.
        let or_not = |frustum: Option<&Mat4>| frustum.copied().unwrap_or(Mat4::NAN);
        let earlier = before.get(&index);
        let (views, frusta) = match parts.frusta {
            Frusta::Buffer(id) => {
                let Some(frusta) = known(id) else { continue };
                let from = |seen: &&Seen| seen.frusta.as_ref().is_some_and(|f| Arc::ptr_eq(f, &frusta));
                let reaches = |seen: &&Seen| seen.views.first().is_none_or(|v| v.row == reach);
                let views = match earlier.filter(from).filter(reaches) {
                    Some(seen) => seen.views.clone(),
                    None => Arc::new(rows.map(|i| View { frustum: or_not(frusta.get(i)), row: reach }).collect()),
                };
                (views, Some(frusta))
            }
            Frusta::Table(i) => {
                let name = plan.tables.get(i).map_or("", |t| t.table.as_str());
                let Some(table) = tables.iter().find(|t| t.name == name) else { continue };
                let column = table.column(super::cull::FRUSTUM);
                let frusta = if let Some(Column::Mat4(all)) = column { Some(all) } else { None };
                let view = |i| View { frustum: or_not(frusta.and_then(|all| all.get(i))), row: row_hash(table, i) };
                (Arc::new(rows.map(view).collect()), None)
            }
        };
        let looks = match &step.action {
            Action::Draw(draw) if draw.indirect.is_some_and(|i| i.occluders) => Looks::Occluders,
            Action::Draw(_) => Looks::Drawn,
            _ => Looks::Rays,
        };
        let still = |seen: &&Seen| Arc::ptr_eq(&seen.views, &views) && seen.world == world;
        let versions = match earlier.filter(still) {
            Some(seen) => seen.versions.clone(),
            None => Members::of(world.versions(&views, looks, earlier)),
        };
        all.insert(index, Seen { versions, views, frusta, world: world.clone(), tables: of.clone() });
    }
    all
}

/// The depths by which it can be told what the members of a step do not show of what moves: those of a target that can be read
/// back, where a fragment that lies behind leaves no trace at all, or those that a dispatch leaves.
pub fn depths(plan: &Plan, step: &Step) -> Option<ResourceId> {
    use wgpu::CompareFunction::{Less, LessEqual};
    let Action::Draw(draw) = &step.action else { return step.sight.as_ref()?.depth };
    let depth = draw.depth.as_ref().filter(|d| matches!(d.compare, Less | LessEqual) && d.write)?;
    let entry = plan.shaders.get(draw.shader)?.interface.entry(Stage::Fragment);
    let placed = entry.is_none_or(|e| !e.writes_depth);
    let readable = match &plan.resources.get(depth.resource.0)?.desc {
        Desc::Texture(t) => worth_reading(t) && t.usage.contains(wgpu::TextureUsages::COPY_SRC),
        Desc::Buffer { .. } => false,
    };
    (placed && readable && draw.color.iter().all(|t| t.blend.is_none())).then_some(depth.resource)
}

/// Whether depths can be read back, and in less time than they may save.
pub(super) fn worth_reading(t: &TextureDesc) -> bool {
    let texels = u64::from(t.width) * u64::from(t.height) * u64::from(t.layers);
    matches!(t.format, wgpu::TextureFormat::Depth32Float | wgpu::TextureFormat::R32Float) && texels <= MOST_DEPTHS
}

/// 16 MiB of them.
const MOST_DEPTHS: u64 = 1 << 22;

impl Seen {
    /// Whether a member that looks where it looked before may show something that moved since: the question that
    /// [`Seen::settle`] answers.
    pub fn unsettled(&self, before: &Seen) -> bool {
        let versions = self.versions.each().iter().zip(before.versions.each());
        let mut views = self.views.iter().zip(before.views.iter()).zip(versions);
        self.versions != before.versions && views.any(|((a, b), (now, then))| a == b && now != then)
    }

    /// Boxes outside of which `some` of the members show what they showed: round what moved, where it was and where it is. `None`
    /// where they look from elsewhere. `without` [`Kind::Moved`] leaves out where it was, for a test to see that the proof notices.
    pub fn moved(&self, before: &Seen, some: &[bool], without: Option<Kind>) -> Option<Vec<Bounds>> {
        let pairs = self.views.iter().zip(before.views.iter());
        let there = self.views.len() == before.views.len() && self.views.len() == some.len();
        if !there || pairs.zip(some).any(|((a, b), some)| *some && a != b) {
            return None;
        }
        // As leaves are wider than their triangles, and as much again for the rounding of whoever asks for these.
        let margin = Vec3::splat(f32::from_bits(self.world.reach() as u32) * 64.0 * f32::EPSILON);
        let moved = self.world.moved(&before.world)?.into_iter();
        let boxes = moved.flat_map(|(then, now)| if without == Some(Kind::Moved) { [now, now] } else { [then, now] });
        let wider = |b: Bounds| Bounds { min: b.min - margin, max: b.max + margin };
        Some(boxes.filter(|b| b.min.cmple(b.max).all()).map(wider).collect())
    }

    /// Gives back the versions of before to members that show nothing of what moved since: it covers no centre of a texel of
    /// theirs, or lies behind what they hold; both where it was and where it is. `held` are the depths that all of them
    /// drew last, those of [`depths`].
    pub fn settle(&mut self, before: &Seen, plan: &Plan, step: &Step, held: Option<&Image>) {
        let Some(moved) = self.world.moved(&before.world) else { return };
        let Some((places, target)) = places(plan, step) else { return };
        let counts = [before.views.len(), places.len(), self.versions.len(), before.versions.len()];
        if counts.iter().any(|count| *count != self.views.len()) {
            return;
        }
        let (mut now, then) = (self.versions.each().to_vec(), before.versions.each());
        for (i, place) in places.into_iter().enumerate() {
            let view = self.views[i];
            if now[i] == then[i] || view != before.views[i] {
                continue;
            }
            let ([x, y, width, height], layer) = match place {
                Place::Rect(rect) => (rect, 0),
                Place::Layer(layer) => ([0, 0, target.width, target.height], layer),
                Place::Whole | Place::LoopLayer(_) => continue,
            };
            let depth = |image: &Image, column: u32, row: u32| {
                let row = u64::from(layer) * u64::from(image.height) + u64::from(y + row);
                let at = row * u64::from(image.width) + u64::from(x + column);
                image.data.get(at as usize).copied().unwrap_or(1.0)
            };
            let shows = |bounds: &Bounds| match covered(&view.frustum, [width, height], bounds) {
                Some(covered) => !held.is_some_and(|image| covered.behind(|c, r| depth(image, c, r))),
                None => false,
            };
            if !moved.iter().any(|(then, now)| shows(then) || shows(now)) {
                now[i] = then[i];
            }
        }
        self.versions = Members::of(now);
    }
}

/// The buffers of frusta that steps go by.
pub fn buffers(apart: &Apart) -> BTreeSet<ResourceId> {
    let of = |parts: &Parts| match parts.frusta {
        Frusta::Buffer(id) => Some(id),
        Frusta::Table(_) => None,
    };
    apart.values().filter_map(of).collect()
}

/// What a member makes where nothing lies in its frustum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Looks {
    /// What follows from its frustum alone.
    Rays,
    /// What it clears its targets to, wherever the frustum is.
    Drawn,
    /// The same, of draws that leave out what can hide nothing from the eye.
    Occluders,
}

/// The version of a member that draws nothing.
const NOTHING: u64 = 0;

/// The tables that a [`World`] is made of.
const WORLD: [&str; 2] = ["nodes", "clusters"];

/// The nodes of a scene at a pose, as draws see them.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    /// By row of the `nodes` table.
    nodes: Vec<Node>,
    /// Between the clusters that lie in a side of the box round everything: from within they hide nothing.
    inside: Bounds,
}

/// A node as draws see it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    /// A hash of its row, and of which of its clusters lie in which sides of the box round everything.
    content: u64,
    /// Round its triangles.
    bounds: Bounds,
    /// Round those that lie in no side.
    inner: Bounds,
}

impl World {
    /// From the tables `nodes` and `clusters`; `None` without them. Of an earlier world, given with its own, those nodes are taken of
    /// which no row is another.
    fn after(tables: &[Table], earlier: Option<(&World, &[Table])>) -> Option<World> {
        let find = |name: &str| tables.iter().find(|t| t.name == name);
        let (rows, clusters) = (find("nodes")?, find("clusters")?);
        let column = |name: &str| clusters.column(name);
        let (Some(Column::Vec3(lower)), Some(Column::Vec3(upper)), Some(Column::Uint(node)), Some(Column::Uint(sides))) =
            (column("lower"), column("upper"), column("node"), column("sides"))
        else {
            return None;
        };
        let differs = |now: &Table, before: &[Table]| now.differs(before.iter().find(|t| t.name == now.name)?);
        let changes =
            earlier.and_then(|(world, before)| Some((world, differs(rows, before)?, differs(clusters, before)?)));
        let mut still = vec![changes.is_some(); rows.rows];
        for row in changes.iter().flat_map(|(_, nodes, _)| nodes.iter().cloned().flatten()) {
            still[row] = false;
        }
        for row in changes.iter().flat_map(|(_, _, clusters)| clusters.iter().cloned().flatten()) {
            if let Some(still) = node.get(row).and_then(|node| still.get_mut(*node as usize)) {
                *still = false;
            }
        }
        let nothing = Node { content: 0, bounds: Bounds::EMPTY, inner: Bounds::EMPTY };
        let mut nodes = vec![(DefaultHasher::new(), 0usize, nothing); rows.rows];
        let mut inside = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
        for (((min, max), sides), node) in lower.iter().zip(upper.iter()).zip(sides.iter()).zip(node.iter()) {
            for axis in (0..3).filter(|_| *sides != 0) {
                if sides >> axis & 1 == 1 {
                    inside.min[axis] = inside.min[axis].max(max[axis]);
                }
                if sides >> (axis + 3) & 1 == 1 {
                    inside.max[axis] = inside.max[axis].min(min[axis]);
                }
            }
            if still.get(*node as usize) != Some(&false) {
                continue;
            }
            let (content, clusters, node) = &mut nodes[*node as usize];
            let bounds = Bounds { min: *min, max: *max };
            node.bounds = node.bounds.union(bounds);
            if *sides == 0 {
                node.inner = node.inner.union(bounds);
            } else {
                (*clusters, sides).hash(content);
            }
            *clusters += 1;
        }
        let known =
            |row: usize| changes.as_ref().filter(|_| still[row]).and_then(|(world, ..)| world.nodes.get(row).copied());
        let finished = |(row, (mut h, clusters, node)): (usize, (DefaultHasher, usize, Node))| {
            known(row).unwrap_or_else(|| {
                (clusters, row_hash(rows, row)).hash(&mut h);
                Node { content: h.finish(), ..node }
            })
        };
        Some(World { nodes: nodes.into_iter().enumerate().map(finished).collect(), inside })
    }

    /// How far it reaches, as [`reach`] says.
    fn reach(&self) -> u64 {
        let all = self.nodes.iter().fold(Bounds::EMPTY, |all, node| all.union(node.bounds));
        u64::from(reach(all).to_bits())
    }

    /// For each view a version of what lies in its frustum: a sum over the nodes in it, so that only those need a look that have
    /// moved since `before`. What [`Seen::settle`] gave back goes on from there: the same world reached in another way may then have
    /// another version, for which a member runs once more than it need.
    fn versions(&self, views: &[View], looks: Looks, before: Option<&Seen>) -> Vec<u64> {
        let hashed = |what: &dyn Fn(&mut DefaultHasher)| {
            let mut h = DefaultHasher::new();
            what(&mut h);
            h.finish()
        };
        let part = |row: usize, node: &Node, planes: &[Vec4; 6]| match meets_planes(planes, &node.bounds) {
            true => hashed(&|h| (row, node.content).hash(h)),
            false => 0,
        };
        let anew = |view: &View| {
            let planes = planes(&view.frustum);
            let within = looks == Looks::Occluders && self.holds(&view.frustum);
            let shown = |node: &Node| meets_planes(&planes, if within { &node.inner } else { &node.bounds });
            if looks != Looks::Rays && !self.nodes.iter().any(shown) {
                return NOTHING;
            }
            let start = hashed(&|h| (view.frustum.to_cols_array().map(f32::to_bits), view.row).hash(h));
            let nodes = self.nodes.iter().enumerate();
            nodes.fold(start, |sum, (row, node)| sum.wrapping_add(part(row, node, &planes)))
        };
        let same = |before: &&Seen| before.world.nodes.len() == self.nodes.len() && before.views.as_slice() == views;
        let Some(before) = before.filter(same) else { return views.iter().map(anew).collect() };
        let pairs = before.world.nodes.iter().zip(&self.nodes).enumerate();
        let moved: Vec<_> = pairs.filter(|(_, (then, now))| then != now).collect();
        let one = |(view, version): (&View, &u64)| {
            // It says nothing of where the frustum is, so nothing can be added to it.
            if *version == NOTHING {
                return anew(view);
            }
            let planes = planes(&view.frustum);
            moved.iter().fold(*version, |sum, (row, (then, now))| {
                sum.wrapping_sub(part(*row, then, &planes)).wrapping_add(part(*row, now, &planes))
            })
        };
        views.iter().zip(before.versions.each()).map(one).collect()
    }

    /// Whether the eye of a view lies well within all sides of the box round everything.
    fn holds(&self, frustum: &Mat4) -> bool {
        let eye = eye(frustum);
        let at = eye.truncate() / eye.w;
        let size = |v: Vec3| v.to_array().into_iter().filter(|x| x.is_finite()).map(f32::abs).fold(0.0, f32::max);
        let slack = 1e-4 * size(at).max(size(self.inside.min)).max(size(self.inside.max));
        eye.w > 0.0 && at.cmpgt(self.inside.min + slack).all() && at.cmplt(self.inside.max - slack).all()
    }

    /// Boxes round what differs from an earlier world: where it was and where it is. `None`: they have other nodes.
    fn moved(&self, before: &World) -> Option<Vec<(Bounds, Bounds)>> {
        let pairs = before.nodes.iter().zip(&self.nodes);
        let moved = pairs.filter(|(then, now)| then != now).map(|(then, now)| (then.bounds, now.bounds));
        (before.nodes.len() == self.nodes.len()).then(|| moved.collect())
    }
}

/// The content of a row.
pub fn row_hash(table: &Table, row: usize) -> u64 {
    let mut h = DefaultHasher::new();
    for (_, column) in table.columns.iter() {
        column.get(row).as_ref().map(Value::bytes).hash(&mut h);
    }
    h.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Tables;

    fn boxed(center: Vec3, half: f32) -> Bounds {
        Bounds { min: center - half, max: center + half }
    }

    const EVERYWHERE: Bounds = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };

    fn node(content: u64, at: Vec3) -> Node {
        Node { content, bounds: boxed(at, 0.5), inner: boxed(at, 0.5) }
    }

    fn saw(versions: Vec<u64>, views: Arc<Vec<View>>, world: Arc<World>) -> Seen {
        Seen { versions: Members::of(versions), views, frusta: None, world, tables: vec![] }
    }

    /// Views from a point along some directions.
    fn look<const N: usize>(from: Vec3, directions: [Vec3; N]) -> [View; N] {
        directions.map(|direction| {
            let up = if direction.y.abs() > 0.5 { Vec3::Z } else { Vec3::Y };
            let frustum = Mat4::perspective_rh(1.0, 1.0, 0.1, 10.0) * Mat4::look_to_rh(from, direction, up);
            View { frustum, row: 0 }
        })
    }

    #[test]
    fn only_the_views_that_an_object_leaves_or_enters_have_a_new_version() {
        let views = look(Vec3::ZERO, [Vec3::X, Vec3::NEG_X, Vec3::Y]);
        let world = |content: u64, at: Vec3| World {
            nodes: vec![node(1, Vec3::Z * 5.0), node(content, at)],
            inside: EVERYWHERE,
        };
        for looks in [Looks::Rays, Looks::Drawn] {
            let versions = |world: &World| world.versions(&views, looks, None);
            let before = versions(&world(7, Vec3::X * 5.0));
            let differ = |after: Vec<u64>| [0, 1, 2].map(|i| before[i] != after[i]);
            assert_eq!(differ(versions(&world(7, Vec3::X * 5.0))), [false, false, false]);
            assert_eq!(differ(versions(&world(8, Vec3::X * 5.0))), [true, false, false], "it turned in place");
            assert_eq!(differ(versions(&world(8, Vec3::Y * 5.0))), [true, false, true]);
            let [a, b, c] = views;
            let other = [View { row: 1, ..a }, View { row: 1, ..b }, c];
            let turned = differ(world(7, Vec3::X * 5.0).versions(&other, looks, None));
            assert_eq!(turned, [true, looks == Looks::Rays, false], "what draws nothing has nothing of its own");
        }
        // From a world to the next, with what was seen before: the same, where rays see it.
        let versions = |world: &World, before: Option<&Seen>| world.versions(&views, Looks::Rays, before);
        let places = [(7, Vec3::X), (8, Vec3::X), (8, Vec3::Y), (9, Vec3::Z), (7, Vec3::X)];
        let worlds = places.map(|(content, at)| world(content, at * 5.0));
        for pair in worlds.windows(2) {
            let views = Arc::new(views.to_vec());
            let seen = saw(versions(&pair[0], None), views, Arc::new(pair[0].clone()));
            assert_eq!(versions(&pair[1], Some(&seen)), versions(&pair[1], None));
        }
    }

    #[test]
    fn a_world_after_another_is_the_one_that_is_made_anew() {
        let scene = crate::scene::load(std::path::Path::new("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}")).scene;
        let tables =
            |pose, earlier: Option<&Tables>| scene.tables_after(pose, |name| WORLD.contains(&name), vec![], earlier);
        let mut before = tables(scene.pose(0.0), None);
        let mut world = World::after(&before.list, None).expect("both tables");
        for node in 0..scene.nodes.len() {
            for by in [Vec3::X * 0.02, Vec3::new(0.0, 9.0, 0.0), Vec3::new(0.0, -8.99, 0.0)] {
                let mut pose = before.pose.clone();
                pose.nodes[node] = Mat4::from_translation(by) * pose.nodes[node];
                let now = tables(pose, Some(&before));
                let found = World::after(&now.list, Some((&world, &before.list))).expect("both tables");
                assert!(found == World::after(&now.list, None).expect("both tables"), "node {node} by {by}");
                assert!(found != world || scene.geometry.clusters.iter().all(|c| c.node != node as u32));
                (before, world) = (now, found);
            }
        }
    }

    #[test]
    fn what_enters_an_empty_view_is_told_with_where_the_view_is() {
        let world = |at: Vec3| Arc::new(World { nodes: vec![node(7, at)], inside: EVERYWHERE });
        let entered = |from: Vec3| {
            let views = Arc::new(look(from, [Vec3::X]).to_vec());
            let empty = world(Vec3::NEG_X * 5.0);
            let versions = empty.versions(&views, Looks::Drawn, None);
            assert_eq!(versions, [NOTHING]);
            let before = saw(versions, views.clone(), empty);
            world(Vec3::X * 5.0).versions(&views, Looks::Drawn, Some(&before))
        };
        assert_ne!(entered(Vec3::ZERO), entered(Vec3::Y * 0.5), "the same thing, seen from elsewhere");
    }

    #[test]
    fn from_within_the_sides_of_everything_only_what_lies_between_them_is_drawn() {
        // A wall and a thing before it, both of one node; the wall is the upper side along x.
        let thing = boxed(Vec3::X * 3.0, 0.5);
        let wall = Bounds { min: Vec3::new(5.0, -5.0, -5.0), max: Vec3::new(5.0, 5.0, 5.0) };
        let room = Node { content: 1, bounds: thing.union(wall), inner: thing };
        let world = World {
            nodes: vec![room],
            inside: Bounds { max: Vec3::new(5.0, f32::INFINITY, f32::INFINITY), ..EVERYWHERE },
        };
        let drawn = |from: Vec3, looks| {
            let views = look(from, [Vec3::X, Vec3::new(1.0, 1.0, 0.0).normalize(), Vec3::NEG_X]);
            world.versions(&views, looks, None).iter().map(|v| *v != NOTHING).collect::<Vec<_>>()
        };
        assert_eq!(drawn(Vec3::ZERO, Looks::Drawn), [true, true, false]);
        assert_eq!(drawn(Vec3::ZERO, Looks::Occluders), [true, false, false]);
        assert_eq!(drawn(Vec3::X * 4.0, Looks::Occluders), [false, false, true]);
        assert_eq!(drawn(Vec3::X * 5.0, Looks::Occluders), [false, true, true], "on the wall: it may hide");
        assert_eq!(drawn(Vec3::ZERO, Looks::Rays), [true, true, true]);
    }
}
