//! What changes a content while a plan lasts, and whether it is asked for when other things change. No device.
//!
//! ```text
//! camera ─→ surface ─→ ┐
//!                      ├─ direct ─→ color      `surface` is asked for when a light moves, and did not change
//! lights ────────────→ ┘
//! ```

use super::{Action, Binding, Frusta, Node, Plan, ResourceId, Step};
use crate::scene::FRAME_VALUES;
use std::ops::{BitOr, BitOrAssign};

/// Things that move from frame to frame, a bit each. What a new plan brings, as another parameter, is none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Moving(u16);

impl Moving {
    pub const CAMERA: Moving = Moving(1);
    pub const NODES: Moving = Moving(2);
    pub const LIGHTS: Moving = Moving(4);

    /// A value that a frame brings, by its place in [`FRAME_VALUES`].
    fn value(place: usize) -> Moving {
        Moving(8 << place)
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

/// A step, or a loop as a whole.
#[derive(Default)]
struct Unit {
    /// What it asks for besides the results of others.
    own: Moving,
    /// Read before it wrote them, or written in part only.
    needs: Vec<ResourceId>,
    writes: Vec<ResourceId>,
}

/// By resource.
pub fn causes(plan: &Plan) -> Vec<Causes> {
    let unit = |node: &Node| {
        let mut unit = Unit::default();
        unit.add(plan, node);
        unit
    };
    let units: Vec<Unit> = plan.order.iter().map(unit).collect();
    let mut all = vec![Causes::default(); plan.resources.len()];
    let of = |unit: &Unit, all: &[Causes]| unit.needs.iter().fold(unit.own, |of, r| of | all[r.0].of);
    // History brings causes from the end of a frame to the beginning of the next.
    loop {
        let before = all.clone();
        for unit in &units {
            let of = of(unit, &all);
            unit.writes.iter().for_each(|r| all[r.0].of |= of);
        }
        if all == before {
            break;
        }
    }
    for unit in &units {
        let of = of(unit, &all);
        unit.needs.iter().for_each(|r| all[r.0].outlived |= all[r.0].of != of);
    }
    all
}

impl Unit {
    fn add(&mut self, plan: &Plan, node: &Node) {
        let step = match node {
            Node::Step(id) => &plan.steps[id.0],
            Node::Loop(l) => return l.body.iter().for_each(|node| self.add(plan, node)),
        };
        self.own |= own(plan, step);
        let whole = matches!(step.action, Action::Copy { .. } | Action::Clear { .. });
        let partly = if whole { [].iter() } else { step.writes.iter() };
        let before = |r: &&ResourceId| !self.writes.contains(r);
        let needs: Vec<ResourceId> = step.reads.iter().chain(partly).filter(before).copied().collect();
        self.needs.extend(needs);
        self.writes.extend(&step.writes);
    }
}

/// What a step asks for besides the results of others.
fn own(plan: &Plan, step: &Step) -> Moving {
    let table = |i: usize| match plan.tables.get(i).map_or("", |t| t.table.as_str()) {
        "materials" => Moving::default(),
        "lights" => Moving::LIGHTS,
        // They reach as far as the scene does.
        "light_views" => Moving::LIGHTS | Moving::NODES,
        _ => Moving::NODES,
    };
    let value = |name: &str| match FRAME_VALUES.iter().position(|v| v.0 == name) {
        Some(_) if name.starts_with("camera_") => Moving::CAMERA,
        Some(place) => Moving::value(place),
        None => Moving::default(),
    };
    let mut all = Moving::default();
    if let Action::Draw(draw) = &step.action
        && let Some(Frusta::Table(i)) = draw.indirect.map(|indirect| indirect.frusta)
    {
        all |= table(i);
    }
    for binding in &step.bindings {
        match binding {
            Binding::Table(i) => all |= table(*i),
            Binding::Uniform { layout, extra } => {
                let read = layout.members.iter().filter(|m| m.read && extra.get(&m.name).is_none());
                read.for_each(|m| all |= value(&m.name));
            }
            Binding::Resource(_)
            | Binding::SceneTextures
            | Binding::Sampler(_)
            | Binding::Report
            | Binding::Members
            | Binding::Moved(_)
            | Binding::Windows { .. } => {}
        }
    }
    all
}
