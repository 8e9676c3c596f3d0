//! How much a frame of a plan does: a measure to compare two plans of one graph by, before anything runs.

use super::{Action, Desc, Node, Place, Plan, ResourceId, Step};

/// Bytes of a texel of four floats, the unit in which contents count.
const TEXEL: u64 = 16;

impl Plan {
    /// Invocations of compute shaders, texels under draws, and for each step all that it may write, in texels of 16
    /// bytes; loops go all of their rounds. What one invocation does is not in it.
    pub fn work(&self) -> u64 {
        self.work_of(&self.order)
    }

    fn work_of(&self, nodes: &[Node]) -> u64 {
        let work = |node: &Node| match node {
            Node::Step(id) => self.steps.get(id.0).map_or(0, |s| self.work_of_step(s)),
            Node::Loop(l) => self.work_of(&l.body).saturating_mul(l.count.into()),
        };
        nodes.iter().map(work).fold(0, u64::saturating_add)
    }

    fn work_of_step(&self, step: &Step) -> u64 {
        let content = |id: &ResourceId| self.resources.get(id.0).map_or(0, |r| r.desc.bytes() / TEXEL);
        let written = step.writes.iter().map(content).fold(0, u64::saturating_add);
        let run = match &step.action {
            Action::Compute { shader, entry, groups, instances, indirect: _ } => {
                let entries = self.shaders.get(*shader).map_or(&[][..], |s| s.interface.entries.as_slice());
                let size = entries.iter().find(|e| e.name == *entry).map_or([1; 3], |e| e.workgroup_size);
                groups.iter().chain(&size).chain(instances).fold(1, |all: u64, n| all.saturating_mul((*n).into()))
            }
            Action::Draw(draw) => {
                let target = draw.color.first().map(|c| c.resource).or(draw.depth.as_ref().map(|d| d.resource));
                let area = |place: &Place| match place {
                    Place::Rect([_, _, width, height]) => u64::from(*width) * u64::from(*height),
                    Place::Whole | Place::Layer(_) | Place::LoopLayer(_) => target.map_or(0, |id| self.layer(id)),
                };
                let views = draw.members.iter().map(|m| area(&m.place)).fold(0, u64::saturating_add);
                views.saturating_mul(draw.views.into())
            }
            Action::Copy { .. } | Action::Clear { .. } => 0,
        };
        run.saturating_add(written)
    }

    /// Texels of one layer.
    fn layer(&self, id: ResourceId) -> u64 {
        match self.resources.get(id.0).map(|r| &r.desc) {
            Some(Desc::Texture(t)) => u64::from(t.width) * u64::from(t.height),
            Some(Desc::Buffer { .. }) | None => 0,
        }
    }
}
