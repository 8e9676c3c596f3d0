//! What changes a content while a plan lasts, and whether it is asked for when other things change. No device.
//!
//! ```text
//! camera ─→ surface ─→ ┐
//!                      ├─ direct ─→ color      `surface` is asked for when a light moves, and did not change
//! lights ────────────→ ┘
//! ```

use super::keys::{Keys, Unit};
use super::{Plan, ResourceId};
use crate::scene::{FRAME_VALUES, Follows, table};
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

/// By resource.
pub fn causes(plan: &Plan) -> Vec<Causes> {
    let units = Keys::of(plan, None).units;
    let mut all = vec![Causes::default(); plan.resources.len()];
    plan.inputs.iter().for_each(|r| all[r.0].of = Moving::INPUTS);
    let own: Vec<Moving> = units.iter().map(|unit| own(plan, unit)).collect();
    let of = |i: usize, all: &[Causes]| {
        let needs: &[ResourceId] = &units[i].needs;
        needs.iter().fold(own[i], |of, r| of | all[r.0].of)
    };
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

/// What a unit asks for besides the results of others.
fn own(plan: &Plan, unit: &Unit) -> Moving {
    let table = |i: usize| {
        let follows = plan.tables.get(i).and_then(|t| table(&t.table)).map_or(Follows::NOTHING, |t| t.follows);
        let mut all = Moving::default();
        if follows.meets(Follows::NODES.and(Follows::MOTION)) {
            all |= Moving::NODES;
        }
        if follows.meets(Follows::LIGHTS) {
            all |= Moving::LIGHTS;
        }
        all
    };
    let value = |name: &str| match FRAME_VALUES.iter().position(|v| v.0 == name) {
        Some(_) if name.starts_with("camera_") => Moving::CAMERA,
        Some(place) => Moving::value(place),
        None => Moving::default(),
    };
    unit.given().map(|given| given.map_or_else(value, table)).fold(Moving::default(), BitOr::bitor)
}
