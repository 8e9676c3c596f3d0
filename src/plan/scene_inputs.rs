//! What the scene gives to a plan, hashed: of a frame's tables as much as has changed. No device.

use super::Plan;
use super::tables::pack;
use crate::content::hash;
use crate::diag::Checked;
use crate::scene::{AssetHashes, Follows, PREVIOUS_TRANSFORM, Table, table};

/// What the scene gives to a plan, hashed.
#[derive(Debug, Clone, Default)]
pub struct SceneInputs {
    pub assets: AssetHashes,
    /// How many frames came before the plan's first.
    pub began: u32,
    /// How many frames came before this one.
    pub frame: u32,
    /// By index of [`Plan::tables`].
    pub(super) tables: Vec<u128>,
}

impl SceneInputs {
    /// # Errors
    /// A table that lacks a column; the planner has checked that, so it is a fault of the caller.
    pub fn new(plan: &Plan, assets: AssetHashes, began: u32, tables: &[Table]) -> Checked<SceneInputs> {
        let mut inputs = SceneInputs { assets, began, frame: began, tables: vec![0; plan.tables.len()] };
        inputs.follow(plan, &[], tables)?;
        Ok(inputs)
    }

    /// Goes on from the tables `before` to others of the same scene; those that are the same cost nothing.
    ///
    /// # Errors
    /// As [`SceneInputs::new`].
    pub fn follow(&mut self, plan: &Plan, before: &[Table], tables: &[Table]) -> Checked<()> {
        let AssetHashes { geometry, order, .. } = self.assets;
        let places = tables.iter().find_map(Table::places);
        let levels: Vec<u128> = plan.levels.iter().map(|level| level.key).collect();
        for (wanted, hashed) in plan.tables.iter().zip(&mut self.tables) {
            let Some(found) = tables.iter().find(|t| t.name == wanted.table) else { continue };
            if before.iter().any(|b| b.is_clone(found)) {
                continue;
            }
            let columns: Vec<_> = wanted.row.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
            let layout = (found.name, &columns, wanted.stride, wanted.rows, wanted.texels);
            *hashed = match (places, table(found.name)) {
                // Where nodes were is none of the places where they are.
                (Some(places), Some(t)) if t.large && columns.iter().all(|c| c.0 != PREVIOUS_TRANSFORM) => {
                    let triangles = t.follows.contains(Follows::TRIANGLES).then_some((geometry, order));
                    let levels = t.follows.contains(Follows::LEVELS).then_some(&levels);
                    hash(&(places, triangles, levels, layout))
                }
                _ => hash(&pack(wanted, found)?),
            };
        }
        Ok(())
    }
}
