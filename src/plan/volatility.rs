//! What changes a content while a plan lasts, and whether it is asked for when other things change. No device.
//!
//! ```text
//! camera ─→ surface ─→ ┐
//!                      ├─ direct ─→ color      `surface` is asked for when a light moves, and did not change
//! lights ────────────→ ┘
//! ```

use super::inputs::{self, Access, Input};
use super::{Node, Plan, ResourceId};
use crate::scene::{self, FRAME_VALUES, Follows};
use std::collections::BTreeSet;
use std::ops::{BitOr, BitOrAssign};

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

/// A step, or a loop as a whole, as far as causes go by it.
#[derive(Default)]
struct UnitUses {
    own: Moving,
    /// Read before the unit itself wrote them, or written in part only.
    needs: BTreeSet<ResourceId>,
    /// Dirty bits excepted, whose content holds for one frame.
    writes: BTreeSet<ResourceId>,
}

/// By resource.
pub fn causes(plan: &Plan) -> Vec<Causes> {
    let unit = |node: &Node| {
        let mut unit = UnitUses::default();
        unit.add(plan, node);
        unit
    };
    let units: Vec<UnitUses> = plan.order.iter().map(unit).collect();
    let mut all = vec![Causes::default(); plan.resources.len()];
    plan.inputs.iter().for_each(|r| all[r.0].of = Moving::INPUTS);
    let of = |unit: &UnitUses, all: &[Causes]| unit.needs.iter().fold(unit.own, |of, r| of | all[r.0].of);
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

impl UnitUses {
    fn add(&mut self, plan: &Plan, node: &Node) {
        match node {
            Node::Loop(l) => l.body.iter().for_each(|node| self.add(plan, node)),
            Node::Step(id) => {
                // What a value is called in which loop makes no difference to what moves it.
                for input in inputs::of(plan, &plan.steps[id.0], &[]) {
                    self.input(plan, &input);
                }
            }
        }
    }

    fn input(&mut self, plan: &Plan, input: &Input) {
        match input {
            Input::Value { name, .. } => self.own |= value(name),
            Input::Table(i) => self.own |= table(plan, *i),
            Input::Resource { id, access } => {
                if matches!(access, Access::Read | Access::Part) && !self.writes.contains(id) {
                    self.needs.insert(*id);
                }
                if matches!(access, Access::Part | Access::Whole) && !plan.resources[id.0].bits {
                    self.writes.insert(*id);
                }
            }
            Input::Fixed { .. } | Input::Geometry | Input::Textures | Input::Began | Input::Bits(_) => {}
        }
    }
}

fn table(plan: &Plan, i: usize) -> Moving {
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

fn value(name: &str) -> Moving {
    match FRAME_VALUES.iter().position(|v| v.0 == name) {
        Some(_) if name.starts_with("camera_") => Moving::CAMERA,
        Some(place) => Moving::value(place),
        None => Moving::default(),
    }
}
