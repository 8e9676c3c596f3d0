//! `--fastest`: which alternatives of a graph run.

use lightgraph::internals::fastest::Policy;
use lightgraph::internals::graph::ast::walk;
use lightgraph::internals::plan::fastest::{Choice, Choices, groups};
use lightgraph::{Checked, Diagnostic, Gpu, Graph, Project, Scene, Settings};
use std::sync::Arc;

/// How alternatives are chosen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Which {
    /// Of every group that isn't named.
    Rest(Policy),
    /// Of this group the one that has this pass.
    Pass(String, String),
}

/// Which alternatives run.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct FastestArgs {
    /// Which of a graph's alternatives run: `measure` (the fastest here, timed once and remembered; the default, but
    /// not of `plan`, which has no device), `first`, or GROUP=PASS, the one with that pass (may be repeated)
    #[arg(long, value_name = "WHICH", value_parser = which)]
    pub fastest: Vec<Which>,
}

impl FastestArgs {
    /// Those that are named.
    ///
    /// # Errors
    /// Groups and passes that the graph does not have.
    pub fn named(&self, graph: &Graph) -> Checked<Choices> {
        let mut choices = Choices::new();
        for which in &self.fastest {
            let Which::Pass(group, pass) = which else { continue };
            let all = groups(graph);
            let Some((_, of)) = all.iter().find(|g| g.0 == group) else {
                let d = Diagnostic::error(format!("the graph has no group of alternatives `{group}`"));
                return Err(d.nearest(group, all.iter().map(|g| g.0)).into());
            };
            let mut passes = vec![];
            of.iter().enumerate().for_each(|(i, way)| walk(way, &mut |p| passes.push((p.name.value.as_str(), i))));
            let Some((_, index)) = passes.iter().find(|p| p.0 == pass) else {
                let d = Diagnostic::error(format!("no alternative of `{group}` has a pass `{pass}`"));
                return Err(d.nearest(pass, passes.iter().map(|p| p.0)).into());
            };
            choices.insert(group.clone(), Choice { index: *index, why: "as asked for".into() });
        }
        Ok(choices)
    }

    /// Those that are named, those that `settings` has, and of the other groups what the rest of the arguments says.
    ///
    /// # Errors
    /// As [`FastestArgs::named`] and [`Policy::choices`].
    pub fn choices(&self, gpu: &Gpu, project: &Project, scene: &Arc<Scene>, settings: &Settings) -> Checked<Choices> {
        let mut settings = settings.clone();
        settings.choices.extend(self.named(&project.graph)?);
        let first = self.fastest.contains(&Which::Rest(Policy::First));
        let policy = if first { Policy::First } else { Policy::Measure };
        policy.choices(gpu, project, scene, &settings)
    }
}

fn which(text: &str) -> Result<Which, String> {
    match text {
        "measure" => Ok(Which::Rest(Policy::Measure)),
        "first" => Ok(Which::Rest(Policy::First)),
        _ => match text.split_once('=') {
            Some((group, pass)) => Ok(Which::Pass(group.trim().into(), pass.trim().into())),
            None => Err("write `measure`, `first`, or GROUP=PASS".into()),
        },
    }
}
