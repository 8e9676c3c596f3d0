//! What changes a content while a plan lasts, and whether it is asked for when other things change. No device.
//!
//! ```text
//! camera ─→ surface ─→ ┐
//!                      ├─ direct ─→ color      `surface` is asked for when a light moves, and did not change
//! lights ────────────→ ┘
//! ```

use super::Plan;
use super::keys::{Keys, Unit};
use std::collections::BTreeSet;

/// Something that moves from frame to frame. What a new plan brings, as another parameter, is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    Camera,
    Nodes,
    Lights,
    /// A value that a frame brings, by its place in [`crate::scene::FRAME_VALUES`].
    Value(usize),
}

/// The causes of a resource's content.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Causes {
    pub of: BTreeSet<Cause>,
    /// Something else changes what is made of it: a content that has not changed is asked for again then.
    pub outlived: bool,
}

/// By resource.
pub fn causes(plan: &Plan) -> Vec<Causes> {
    let keys = Keys::of(plan, None);
    let mut all = vec![Causes::default(); plan.resources.len()];
    let of = |unit: &Unit, all: &[Causes]| -> BTreeSet<Cause> {
        own(plan, unit).into_iter().chain(unit.needs.iter().flat_map(|r| all[r.0].of.clone())).collect()
    };
    // History brings causes from the end of a frame to the beginning of the next.
    loop {
        let before = all.clone();
        for unit in &keys.units {
            let of = of(unit, &all);
            unit.writes.iter().for_each(|r| all[r.0].of.extend(of.clone()));
        }
        if all == before {
            break;
        }
    }
    for unit in &keys.units {
        let of = of(unit, &all);
        for r in unit.needs.iter().filter(|r| all[r.0].of != of).collect::<Vec<_>>() {
            all[r.0].outlived = true;
        }
    }
    all
}

/// What a unit asks for besides the results of others.
fn own(plan: &Plan, unit: &Unit) -> BTreeSet<Cause> {
    let mut all = BTreeSet::new();
    for table in unit.tables(plan) {
        match table {
            "materials" => {}
            "lights" => drop(all.insert(Cause::Lights)),
            // They reach as far as the scene does.
            "light_views" => all.extend([Cause::Lights, Cause::Nodes]),
            _ => drop(all.insert(Cause::Nodes)),
        }
    }
    for name in unit.frame_values() {
        let place = crate::scene::FRAME_VALUES.iter().position(|v| v.0 == name);
        all.insert(if name.starts_with("camera_") { Cause::Camera } else { Cause::Value(place.unwrap_or(0)) });
    }
    all
}
