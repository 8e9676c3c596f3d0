//! A bench as jobs, which machines share.
//!
//! A job is a group of settings of one graph on one scene, or another renderer on one scene. The list follows from what
//! is asked for alone, so that every machine makes the same one: shard `k/n` takes its jobs of it without asking the
//! others, and what they find is joined by number.

use super::results::hash;
use crate::shard::Shard;
use lightgraph::{Checked, Diagnostic};
use serde::{Deserialize, Serialize};

/// Parameters and values, as `--set` takes them.
pub type Setting = Vec<(String, String)>;

/// Settings of a job at most. Each job may load a scene and compile a graph anew: of one setting it would be mostly
/// that, and of all of them the slowest graph would keep one machine when the others are done.
const GROUP: usize = 8;

/// Jobs of a part at most: those of a file are counted one by one, and more are not measured in a year.
const MOST_JOBS: usize = 1_000_000;

/// A piece of work that runs on one machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// From 0.
    pub number: usize,
    /// Index of the scene and camera.
    pub view: usize,
    pub work: Work,
}

/// What a job does on its scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Work {
    /// A graph, by index, at some of its settings.
    Graph { graph: usize, settings: Vec<Setting> },
    /// Another renderer, by index.
    Peer(usize),
}

/// All jobs of so many views and peers, scene by scene; `settings` are those of each graph.
pub fn jobs(views: usize, settings: &[Vec<Setting>], peers: usize) -> Vec<Job> {
    let groups = settings
        .iter()
        .enumerate()
        .flat_map(|(graph, all)| all.chunks(GROUP).map(move |group| Work::Graph { graph, settings: group.to_vec() }));
    let of_a_view: Vec<Work> = groups.chain((0..peers).map(Work::Peer)).collect();
    let all = (0..views).flat_map(|view| of_a_view.iter().map(move |work| (view, work.clone())));
    all.enumerate().map(|(number, (view, work))| Job { number, view, work }).collect()
}

/// What a part of a bench holds, for those who join parts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    pub shard: Shard,
    /// A hash of the list of jobs and of what made it: parts of one bench have the same.
    pub whole: String,
    /// Jobs of the whole.
    pub jobs: usize,
    /// Those done here, in the order of their entries.
    pub done: Vec<Done>,
}

/// A job that is done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Done {
    pub job: usize,
    /// How many entries came of it.
    pub entries: usize,
}

impl Part {
    /// Of nothing yet. `made_of` tells benches apart that have the same jobs: version, commit, size, phases.
    pub fn new(shard: Shard, jobs: &[Job], made_of: &[String]) -> Part {
        let listed = jobs.iter().map(|job| format!("{job:?}"));
        let text: Vec<String> = listed.chain(made_of.iter().cloned()).collect();
        let whole = hash(text.iter().map(String::as_bytes));
        Part { shard, whole, jobs: jobs.len(), done: vec![] }
    }

    /// # Errors
    /// Numbers that no run wrote.
    pub fn check(&self, shown: &str, entries: usize) -> Checked<()> {
        const REMEDY: &str = "measure this part again: `lightgraph bench --shard` writes it anew";
        if self.jobs > MOST_JOBS {
            let d = Diagnostic::error(format!("{shown} tells of {} jobs, and {MOST_JOBS} are the most", self.jobs));
            return Err(d.help(REMEDY).into());
        }
        let own = |d: &Done| d.job < self.jobs && self.shard.has(d.job);
        let counted = self.done.iter().try_fold(0usize, |n, d| n.checked_add(d.entries));
        if self.shard.is_valid() && self.done.iter().all(own) && counted.is_some_and(|n| n <= entries) {
            return Ok(());
        }
        let d = Diagnostic::error(format!("{shown} holds no part of a bench: its jobs and entries disagree"));
        Err(d.help(REMEDY).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(n: usize) -> Vec<Setting> {
        (0..n).map(|i| vec![("n".to_string(), i.to_string())]).collect()
    }

    #[test]
    fn every_setting_is_in_one_job_and_every_job_in_one_shard() {
        let all = jobs(3, &[settings(1), settings(20), settings(8)], 1);
        // Of each view: one group, three, one, and the other renderer.
        assert_eq!(all.len(), 3 * 6);
        assert!(all.iter().enumerate().all(|(i, job)| job.number == i));
        let listed = all.iter().filter(|j| j.view == 1).filter_map(|j| match &j.work {
            Work::Graph { graph: 1, settings } => Some(settings.clone()),
            _ => None,
        });
        assert_eq!(listed.flatten().collect::<Vec<_>>(), settings(20));
        for of in 1..=25 {
            let owners = |job: usize| (1..=of).filter(|number| Shard { number: *number, of }.has(job)).count();
            assert!((0..all.len()).all(|job| owners(job) == 1), "{of} shards");
            let sizes = (1..=of).map(|number| all.iter().filter(|j| Shard { number, of }.has(j.number)).count());
            let (least, most) = sizes.fold((usize::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
            assert!(most - least <= 1, "{of} shards of {least} to {most} jobs");
        }
    }

    #[test]
    fn a_part_of_more_jobs_than_are_ever_measured_is_refused() {
        let check = |jobs| Part { jobs, ..Part::new(Shard::WHOLE, &[], &[]) }.check("results.json", 0);
        assert_eq!(check(MOST_JOBS), Ok(()));
        let said = check(usize::MAX).unwrap_err().to_string();
        assert!(said.contains(&format!("results.json tells of {} jobs, and {MOST_JOBS} are", usize::MAX)), "{said}");
    }

    #[test]
    fn benches_that_differ_are_told_apart() {
        let whole = |n, made_of: &str| Part::new(Shard::WHOLE, &jobs(1, &[settings(n)], 0), &[made_of.into()]).whole;
        assert_eq!(whole(3, "a"), whole(3, "a"));
        assert_ne!(whole(3, "a"), whole(2, "a"));
        assert_ne!(whole(3, "a"), whole(3, "b"));
    }
}
