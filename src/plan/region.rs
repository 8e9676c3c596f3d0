//! Draws and dispatches over many views, member by member: what each sees, so that each has a version of its own and only
//! those whose version is new run again. No device.

use super::ingredient::Kind;
use super::member::Members;
use super::sight::{covered, eye};
use super::window::{MOST_LAYERS, SQUARES, Window, clear_cut, meets_square};
use super::world::{Looks, View, WORLD, World, row_hash};
use super::{
    Action, Binding, ColorTarget, DepthTarget, Desc, Draw, Frusta, Place, Plan, ResourceId, Sight, Step, TextureDesc,
};
use crate::image::Image;
use crate::scene::{Bounds, Column, Table};
use crate::shader::Stage;
use glam::{Mat4, Vec3};
use std::collections::{BTreeMap, BTreeSet};
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
    /// Of a draw to layers: a version of each of [`SQUARES`] by as many squares of each, row by row, layer after layer; else none.
    pub squares: Members,
    views: Arc<Vec<View>>,
    /// The buffer of frusta that the views are of.
    frusta: Option<Arc<Vec<Mat4>>>,
    world: Arc<World>,
    /// Those that the world is of.
    tables: Vec<Table>,
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
            None => {
                let earlier = earlier.map(|seen| (&*seen.world, seen.views.as_slice(), seen.versions.each()));
                Members::of(world.versions(&views, looks, earlier))
            }
        };
        let layered = |draw: &Draw| {
            draw.members.len() <= MOST_LAYERS && draw.members.iter().all(|m| matches!(m.place, Place::Layer(_)))
        };
        let squares = match &step.action {
            Action::Draw(draw) if layered(draw) => squares_of(&versions),
            _ => Members::default(),
        };
        all.insert(index, Seen { versions, squares, views, frusta, world: world.clone(), tables: of.clone() });
    }
    all
}

/// Versions of squares of layers that are as new as these.
fn squares_of(layers: &Members) -> Members {
    let count = (SQUARES * SQUARES) as usize * layers.len();
    Members::reading(count, vec![(0, layers.clone())])
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
            let Some(([x, y, width, height], layer)) = room(place, target) else { continue };
            let depth = |image: &Image, column: u32, row: u32| {
                let row = u64::from(layer) * u64::from(image.height) + u64::from(y + row);
                let at = row * u64::from(image.width) + u64::from(x + column);
                image.data.get(at as usize).copied().unwrap_or(1.0)
            };
            let shows = |bounds: &Bounds| match covered(&view.frustum, [width, height], bounds) {
                Some(covered) => !held.is_some_and(|image| covered.behind(|c, r| depth(image, c, r))),
                None => false,
            };
            // To look at all clusters takes longer than at what moved.
            if !moved.iter().any(|(then, now)| shows(then) || shows(now)) && self.leaves_out_alike(before, step, &view)
            {
                now[i] = then[i];
            }
        }
        self.versions = Members::of(now);
    }

    /// By member of a draw that looks where it looked, and shows something that moved since: the part of its place that this covered
    /// and covers. `without` is that of [`Seen::moved`].
    pub fn windows(&self, before: &Seen, plan: &Plan, step: &Step, without: Option<Kind>) -> Vec<Option<Window>> {
        let (Some(moved), Some((places, target))) = (self.world.moved(&before.world), places(plan, step)) else {
            return vec![];
        };
        let counts = [before.views.len(), places.len(), self.versions.len(), before.versions.len()];
        if counts.iter().any(|count| *count != self.views.len()) {
            return vec![];
        }
        let (now, then) = (self.versions.each(), before.versions.each());
        let window = |(i, place): (usize, Place)| {
            let view = &self.views[i];
            let again = now[i] != then[i] && *view == before.views[i] && self.leaves_out_alike(before, step, view);
            let ([_, _, width, height], _) = room(place, target).filter(|_| again)?;
            let boxes =
                moved.iter().flat_map(|(was, is)| if without == Some(Kind::Moved) { [is, is] } else { [was, is] });
            Window::round(boxes.filter_map(|b| covered(&view.frustum, [width, height], b)), [width, height])
        };
        places.into_iter().enumerate().map(window).collect()
    }

    /// Gives squares the versions of before where nothing of them has changed: in layers that are as they were, and round the
    /// `windows` of others.
    pub fn keep_squares(&mut self, before: &Seen, plan: &Plan, step: &Step, windows: &[Option<Window>]) {
        if self.squares.is_empty() || self.squares.len() != before.squares.len() {
            return;
        }
        if self.versions == before.versions {
            self.squares = before.squares.clone();
            return;
        }
        let layers = self.versions.each().iter().zip(before.versions.each());
        if windows.is_empty() && layers.clone().all(|(now, then)| now != then) {
            return;
        }
        let Some((_, target)) = places(plan, step) else { return };
        let each = SQUARES * SQUARES;
        let stays = layers.enumerate().flat_map(|(i, (now, then))| {
            let window = windows.get(i).copied().flatten();
            let outside =
                move |square| window.is_some_and(|w| !meets_square(&w, square, [target.width, target.height]));
            (0..each).map(move |square| now == then || outside(square))
        });
        let fresh = squares_of(&self.versions);
        let squares = stays.zip(fresh.each().iter().zip(before.squares.each()));
        self.squares = Members::of(squares.map(|(stays, (new, old))| if stays { *old } else { *new }).collect());
    }

    /// Whether a draw leaves out the same in a view as before, of all that shows nothing which moved.
    fn leaves_out_alike(&self, before: &Seen, step: &Step, view: &View) -> bool {
        let Action::Draw(Draw { indirect: Some(indirect), .. }) = &step.action else { return true };
        let cut = |clusters: &Table| clear_cut(indirect, clusters, eye(&view.frustum));
        let clear = |seen: &Seen| seen.tables.iter().find(|t| t.name == "clusters").is_some_and(cut);
        !indirect.occluders || clear(before) && clear(self)
    }
}

/// A place of its own in a target: the rectangle, and the layer.
fn room(place: Place, target: &TextureDesc) -> Option<([u32; 4], u32)> {
    match place {
        Place::Rect(rect) => Some((rect, 0)),
        Place::Layer(layer) => Some(([0, 0, target.width, target.height], layer)),
        Place::Whole | Place::LoopLayer(_) => None,
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
