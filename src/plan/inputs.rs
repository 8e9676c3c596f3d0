//! Lists the inputs of a step. Fingerprints, the reasons shown for a run, volatility and the lifetimes of memory all
//! follow from this one list. Needs no device.
//!
//! Volatility states what can change a content while a plan lasts. A content may also be requested again when
//! something else changes:
//!
//! ```text
//! camera ─→ surface ─→ ┐
//!                      ├─ direct ─→ color      `surface` is asked for when a light moves, and did not change
//! lights ────────────→ ┘
//! ```

use super::keys::Keys;
use super::{
    Action, Binding, ColorTarget, DepthTarget, Draw, DrawGeometry, Frames, Frusta, Indirect, Only, Plan, ResourceId,
    Step,
};
use crate::content::hash;
use crate::graph::check::FIRST_FRAME;
use crate::scene::{self, CONTENT_HASH, FRAME_VALUES, Follows};
use crate::shader::Layout;
use crate::value::{Value, Values};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hash;
use std::ops::{BitOr, BitOrAssign};
use std::sync::Arc;

/// The kinds of inputs, for messages and for tests that leave one out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum InputKind {
    /// The code that runs.
    Shader,
    /// Bytes of uniforms: parameters, facts, values of the frame, a member's index.
    Value,
    /// Rows of a scene's table.
    Table,
    /// The scene's triangles.
    Geometry,
    /// The scene's textures.
    Textures,
    /// The version of a resource that is read, or written in part only.
    Resource,
    /// Format, extent, layers and mips of a resource.
    Size,
    /// How drawing changes its targets: clear values, blending, depth test, culling.
    Target,
    /// Workgroups, draws and where they go, the value of a clear, and which variable stands for which resource.
    Extent,
    /// How often a loop goes round, and what ends it.
    Loop,
    Sampler,
}

/// Every kind that is in fingerprints.
pub const KINDS: [InputKind; 11] = [
    InputKind::Shader,
    InputKind::Value,
    InputKind::Table,
    InputKind::Geometry,
    InputKind::Textures,
    InputKind::Resource,
    InputKind::Size,
    InputKind::Target,
    InputKind::Extent,
    InputKind::Loop,
    InputKind::Sampler,
];

/// One input, by the name to show.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Named {
    pub kind: InputKind,
    pub name: String,
}

impl std::fmt::Display for Named {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = &self.name;
        match self.kind {
            InputKind::Shader => write!(f, "shader {name}"),
            InputKind::Value | InputKind::Resource => f.write_str(name),
            InputKind::Table => write!(f, "table {name}"),
            InputKind::Geometry => f.write_str("the scene's triangles"),
            InputKind::Textures => f.write_str("the scene's textures"),
            InputKind::Size => write!(f, "size of {name}"),
            InputKind::Target => f.write_str("how it draws"),
            InputKind::Extent => f.write_str("how much it does"),
            InputKind::Loop => write!(f, "loop {name}"),
            InputKind::Sampler => write!(f, "sampler {name}"),
        }
    }
}

/// Named inputs with hashes of their contents.
pub type Contents = BTreeMap<Named, u128>;

/// What a unit read in a frame.
#[derive(Debug)]
pub struct ReadInputs {
    pub(super) fixed: Arc<Contents>,
    pub(super) names: Arc<[Named]>,
    /// Of `names`.
    pub(super) hashes: Vec<u128>,
}

impl ReadInputs {
    fn contents(&self) -> Contents {
        let mut all = Contents::clone(&self.fixed);
        self.names.iter().zip(&self.hashes).for_each(|(named, content)| add(&mut all, named.clone(), *content));
        all
    }

    /// What is new or different since, and what is gone.
    pub(super) fn differences(&self, before: &ReadInputs) -> Vec<String> {
        if Arc::ptr_eq(&self.fixed, &before.fixed) && Arc::ptr_eq(&self.names, &before.names) {
            let all = self.names.iter().zip(self.hashes.iter().zip(&before.hashes));
            let changed: BTreeSet<&Named> =
                all.filter(|(_, (now, then))| now != then).map(|(named, _)| named).collect();
            return changed.into_iter().map(Named::to_string).collect();
        }
        let (before, now) = (before.contents(), self.contents());
        let changed = now.iter().filter(|(k, v)| before.get(k) != Some(v)).map(|(k, _)| k.to_string());
        let gone = before.keys().filter(|k| !now.contains_key(k)).map(|k| format!("no {k} any more"));
        changed.chain(gone).collect()
    }
}

/// Adds an input. Two of one name, as two rows of one table, both count.
pub(super) fn add(all: &mut Contents, input: Named, content: u128) {
    all.entry(input).and_modify(|there| *there = hash(&(*there, content))).or_insert(content);
}

/// One input of a step.
#[derive(Debug)]
pub enum StepInput<'p> {
    /// Known with the plan, by a hash.
    Fixed {
        kind: InputKind,
        name: &'p str,
        content: u128,
    },
    /// A value that a frame may bring; else the plan's.
    Value {
        name: &'p str,
        known: Option<Value>,
    },
    /// A resource, by how the step uses it.
    Resource {
        id: ResourceId,
        access: ResourceAccess,
    },
    /// Index into [`Plan::tables`].
    Table(usize),
    /// Positions, indices and materials of the scene's triangles.
    Geometry,
    Textures,
    /// The plan itself: when it began.
    Began,
    /// Dirty bits: what they say holds for one frame.
    Bits(ResourceId),
}

/// How a step uses a resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResourceAccess {
    /// The step binds it, for its size at least.
    Bound,
    Read,
    /// All of it is overwritten.
    Whole,
    /// Some of it may be left as it was.
    Part,
}

/// The inputs of a step within loops of these names, outermost first.
///
/// Every struct is taken apart with all its fields named, so that a new field of a plan can't be forgotten here.
pub fn of<'p>(plan: &'p Plan, step: &'p Step, around: &[&str]) -> Vec<StepInput<'p>> {
    let mut list = List { plan, all: vec![] };
    let Step { name: _, pass: _, group: _, frames, action, bindings, reads, writes, only, after: _ } = step;
    if *frames != Frames::All {
        list.all.push(StepInput::Value { name: FIRST_FRAME, known: None });
    }
    let mut variables = [].as_slice();
    let mut frusta = None;
    match action {
        Action::Draw(draw) => {
            frusta = list.draw(draw);
            variables = &plan.shaders[draw.shader].interface.variables;
        }
        Action::Compute { shader, entry, groups, instances, indirect } => {
            list.shader(*shader, entry);
            list.fix(InputKind::Extent, "", &(groups, instances));
            indirect.iter().for_each(|buffer| list.uses(*buffer, ResourceAccess::Bound));
            variables = &plan.shaders[*shader].interface.variables;
        }
        Action::Copy { from, to } => {
            list.uses(*from, ResourceAccess::Bound);
            list.uses(*to, ResourceAccess::Bound);
        }
        Action::Clear { target, value } => {
            list.uses(*target, ResourceAccess::Bound);
            list.fix(InputKind::Extent, "", &(plan.resources[target.0].number, value.map(f64::to_bits)));
        }
    }
    for (at, binding) in bindings.iter().enumerate() {
        match binding {
            Binding::Resource(id) => list.uses(*id, ResourceAccess::Bound),
            Binding::Level(id, mip) => {
                list.uses(*id, ResourceAccess::Bound);
                list.fix(InputKind::Extent, "", &("level", mip));
            }
            Binding::Uniform { layout, extra } => list.uniform(layout, extra, around),
            // Where things moved decides which instances run, never what they make.
            Binding::Table(i) if only.is_some() && plan.tables[*i].table == crate::scene::MOVED => {}
            Binding::Table(i) => list.all.push(StepInput::Table(*i)),
            // The instances that run make no difference to what all of them leave.
            Binding::Instances => {}
            Binding::SceneTextures => list.all.push(StepInput::Textures),
            // A plan knows of no checks but those of its own runs.
            Binding::Report => list.all.push(StepInput::Began),
            Binding::Sampler(desc) => {
                let name = variables.get(at).map_or("", |v| v.name.as_str());
                list.fix(InputKind::Sampler, name, desc);
            }
        }
    }
    let bits = |id: &ResourceId| plan.resources[id.0].bits;
    let hint = |id: &&ResourceId| only.as_ref().is_none_or(|only: &Only| only.bits != **id);
    for id in reads.iter().chain(&frusta).filter(hint) {
        match bits(id) {
            true => list.all.push(StepInput::Bits(*id)),
            false => list.uses(*id, ResourceAccess::Read),
        }
    }
    // What other frames hold is in it, where it does not run.
    let whole = *frames == Frames::All && matches!(action, Action::Copy { .. } | Action::Clear { .. });
    for id in writes {
        // The instances of a pass cover all that it writes, where nothing else writes there.
        let alone = || plan.steps.iter().filter(|s| s.writes.contains(id)).count() == 1;
        let access =
            if whole || bits(id) || only.is_some() && alone() { ResourceAccess::Whole } else { ResourceAccess::Part };
        list.uses(*id, access);
    }
    list.all
}

struct List<'p> {
    plan: &'p Plan,
    all: Vec<StepInput<'p>>,
}

impl<'p> List<'p> {
    fn fix(&mut self, kind: InputKind, name: &'p str, content: &impl Hash) {
        self.all.push(StepInput::Fixed { kind, name, content: hash(content) });
    }

    fn uses(&mut self, id: ResourceId, access: ResourceAccess) {
        self.all.push(StepInput::Resource { id, access });
    }

    fn shader(&mut self, index: usize, entries: &impl Hash) {
        let shader = &self.plan.shaders[index];
        self.fix(InputKind::Shader, &shader.path, &(shader.content, entries));
    }

    /// Returns the buffer that holds the frusta of the instances, if any does.
    fn draw(&mut self, draw: &'p Draw) -> Option<ResourceId> {
        let Draw { shader, vertex, fragment, geometry, color, depth, members, indirect, samples: _, views, level } =
            draw;
        self.shader(*shader, &(vertex, fragment));
        match geometry {
            DrawGeometry::Scene { cull } => {
                self.fix(InputKind::Target, "", cull);
                self.all.push(StepInput::Geometry);
            }
            DrawGeometry::Screen => self.fix(InputKind::Target, "", &"screen"),
            DrawGeometry::Vertices { count, instances, topology, cull, indirect } => {
                self.fix(InputKind::Target, "", &(topology, cull));
                self.fix(InputKind::Extent, "", &(count, instances));
                indirect.iter().for_each(|buffer| self.uses(*buffer, ResourceAccess::Bound));
            }
        }
        for ColorTarget { resource, mip, location, format, clear, blend, resolve } in color {
            self.uses(*resource, ResourceAccess::Bound);
            resolve.iter().for_each(|id| self.uses(*id, ResourceAccess::Bound));
            let clear = clear.map(|c| c.map(f64::to_bits));
            self.fix(InputKind::Target, "", &(mip, location, format, clear, blend));
        }
        if let Some(DepthTarget { resource, format, clear, compare, write }) = depth {
            self.uses(*resource, ResourceAccess::Bound);
            self.fix(InputKind::Target, "", &(format, clear.map(f32::to_bits), compare, write));
        }
        self.fix(InputKind::Extent, "", &(members, views));
        // The rest of a level follows from the scene's triangles.
        if let Some(level) = level.and_then(|i| self.plan.levels.get(i)) {
            self.fix(InputKind::Extent, "", &level.key);
        }
        let Indirect { buffer, first, second, frusta, occluders, clusters } = (*indirect)?;
        self.uses(buffer, ResourceAccess::Bound);
        self.fix(InputKind::Extent, "", &(first, second, occluders, clusters));
        match frusta {
            Frusta::Table(i) => {
                self.all.push(StepInput::Table(i));
                None
            }
            Frusta::Buffer(id) => Some(id),
        }
    }

    /// The values in a uniform's bytes. Their places in it are the shader's.
    fn uniform(&mut self, layout: &'p Layout, extra: &Values, around: &[&str]) {
        for member in layout.members.iter().filter(|m| m.read) {
            let name = member.name.as_str();
            if let Some(value) = extra.get(name) {
                self.fix(InputKind::Value, name, &(value.ty(), value.bytes()));
            } else if let Some(depth) = around.iter().rposition(|l| *l == name) {
                self.fix(InputKind::Loop, name, &("index", depth));
            } else {
                self.all.push(StepInput::Value { name, known: self.plan.values.get(name).copied() });
            }
        }
    }
}

/// Things that move from frame to frame, a bit each. What a new plan brings, as another parameter, is none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moving(u32);

impl Moving {
    pub const CAMERA: Moving = Moving(1);
    pub const NODES: Moving = Moving(2);
    pub const LIGHTS: Moving = Moving(4);
    /// What the graph takes from outside.
    pub const INPUTS: Moving = Moving(8);

    /// A value that a frame brings, by its place in [`FRAME_VALUES`].
    fn value(place: usize) -> Moving {
        Moving(16 << place)
    }

    /// Whether nothing else moves here than there.
    pub fn is_among(self, others: Moving) -> bool {
        self | others == others
    }
}

impl BitOr for Moving {
    type Output = Moving;

    fn bitor(self, other: Moving) -> Moving {
        Moving(self.0 | other.0)
    }
}

impl BitOrAssign for Moving {
    fn bitor_assign(&mut self, other: Moving) {
        *self = *self | other;
    }
}

/// The causes of a resource's content.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Causes {
    pub of: Moving,
    /// Something else changes what is made of it: a content that has not changed is asked for again then.
    pub outlived: bool,
}

/// By resource.
pub fn causes(plan: &Plan) -> Vec<Causes> {
    let units = Keys::of(plan, None).units;
    let own: Vec<Moving> = units.iter().map(|unit| unit.moving(plan)).collect();
    let mut all = vec![Causes::default(); plan.resources.len()];
    plan.inputs.iter().for_each(|r| all[r.0].of = Moving::INPUTS);
    let of = |i: usize, all: &[Causes]| units[i].needs.iter().fold(own[i], |of, r| of | all[r.0].of);
    // History brings causes from the end of a frame to the beginning of the next.
    loop {
        let before = all.clone();
        for (i, unit) in units.iter().enumerate() {
            let of = of(i, &all);
            unit.writes.iter().for_each(|r| all[r.0].of |= of);
        }
        if all == before {
            break;
        }
    }
    for (i, unit) in units.iter().enumerate() {
        let of = of(i, &all);
        unit.needs.iter().for_each(|r| all[r.0].outlived |= all[r.0].of != of);
    }
    all
}

/// The volatility of a table's rows.
pub(super) fn table(plan: &Plan, i: usize) -> Moving {
    let follows = plan.tables.get(i).and_then(|t| scene::table(&t.table)).map_or(Follows::NOTHING, |t| t.follows);
    let mut all = Moving::default();
    if follows.meets(Follows::NODES.and(Follows::MOTION)) {
        all |= Moving::NODES;
    }
    if follows.meets(Follows::LIGHTS) {
        all |= Moving::LIGHTS;
    }
    all
}

/// The volatility of a value.
pub(super) fn value(plan: &Plan, name: &str) -> Moving {
    let lent = if plan.inputs.is_empty() { Moving::default() } else { Moving::INPUTS };
    match FRAME_VALUES.iter().position(|v| v.0 == name) {
        Some(_) if name.starts_with("camera_") => Moving::CAMERA,
        Some(_) if name == CONTENT_HASH => Moving::NODES | Moving::LIGHTS | lent,
        Some(place) => Moving::value(place),
        None => Moving::default(),
    }
}
