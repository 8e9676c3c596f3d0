//! What checks of numbers found: readings of resources, and the writes that left numbers which should not be.

use crate::diag::Diagnostic;
use crate::plan::{Desc, Plan, ResourceId, StepId};

/// What the checks of a frame found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Numerics {
    /// Every resource that a step of the frame wrote and that holds floats, in the order of their first write.
    pub readings: Vec<ResourceNumbers>,
    /// Of each resource, the first write after which something was wrong, in the order of the steps.
    pub broken: Vec<Broken>,
}

/// The numbers of a resource, all channels together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResourceNumbers {
    pub resource: ResourceId,
    /// How often it was checked in the frame.
    pub checks: u32,
    /// Over all checks. Above `largest` when it has no finite number.
    pub least: f64,
    pub largest: f64,
    /// After the last write: the sum of the magnitudes, in the resource's own unit.
    pub energy: f64,
    /// The part of `energy` that is below zero.
    pub negative: f64,
}

/// A write that left numbers which should not be.
#[derive(Debug, Clone, PartialEq)]
pub struct Broken {
    pub step: StepId,
    /// Of the loops around the step, outermost first.
    pub iterations: Vec<u32>,
    pub resource: ResourceId,
    /// How many numbers are none, infinite, below and above the resource's range.
    pub not_numbers: u64,
    pub infinite: u64,
    pub below: u64,
    pub above: u64,
    /// Column, row, and layer or slice of the first; of a buffer: element, word of the element, 0.
    pub texel: [u32; 3],
}

impl Numerics {
    /// The faults, in the order of the steps: the first is where the trouble starts.
    pub fn faults(&self, plan: &Plan) -> Vec<Diagnostic> {
        let name = |id: ResourceId| plan.resources.get(id.0).map_or("?", |r| r.name.as_str());
        let mut all = vec![];
        for b in &self.broken {
            let step = plan.steps.get(b.step.0).map_or("?", |s| s.name.as_str());
            let resource = plan.resources.get(b.resource.0);
            let bound = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
            let kinds = [
                (b.not_numbers, "NaN".to_string()),
                (b.infinite, "infinite".to_string()),
                (b.below, format!("below {}", bound(resource.and_then(|r| r.min)))),
                (b.above, format!("above {}", bound(resource.and_then(|r| r.max)))),
            ];
            let counts: Vec<String> = kinds.iter().filter(|k| k.0 > 0).map(|(n, what)| format!("{n} {what}")).collect();
            let [x, y, z] = b.texel;
            let place = match resource.map(|r| &r.desc) {
                Some(Desc::Buffer { .. }) => format!("element {x}, word {y}"),
                _ => format!("texel ({x}, {y}), layer {z}"),
            };
            let turn: Vec<String> = b.iterations.iter().map(ToString::to_string).collect();
            let turn = if turn.is_empty() { String::new() } else { format!(" in iteration {}", turn.join(", ")) };
            let resource = name(b.resource);
            let text =
                format!("`{step}` leaves numbers in `{resource}` that should not be{turn}: {}", counts.join(", "));
            let d = Diagnostic::error(text).help(format!("the first is at {place}"));
            all.push(match all.is_empty() {
                true => {
                    d.help("look for a division by zero, a root or a power of a negative number, a sum without end")
                }
                false => d,
            });
        }
        all
    }

    /// What holds after a later frame: what was found of a resource stands until that is written again.
    pub fn then(self, later: Numerics) -> Numerics {
        let again = |resource: ResourceId| later.readings.iter().any(|r| r.resource == resource);
        let readings: Vec<ResourceNumbers> = self.readings.into_iter().filter(|r| !again(r.resource)).collect();
        let broken: Vec<Broken> = self.broken.into_iter().filter(|b| !again(b.resource)).collect();
        Numerics {
            readings: readings.into_iter().chain(later.readings).collect(),
            broken: broken.into_iter().chain(later.broken).collect(),
        }
    }

    /// The reading of a resource by its name.
    pub fn reading(&self, plan: &Plan, name: &str) -> Option<&ResourceNumbers> {
        self.readings.iter().find(|r| plan.resources.get(r.resource.0).is_some_and(|x| x.name == name))
    }
}
