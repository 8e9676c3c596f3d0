//! `lightgraph bench` on several machines: the list of jobs, a script for Slurm, the parts joined.

use super::bench::BenchArgs;
use super::course::Lists;
use super::page::publish;
use super::{Failure, print};
use crate::bench::jobs::{Setting, Work};
use crate::bench::merge::merge;
use crate::bench::results::{Phase, Results};
use crate::shard::Shard;
use clap::ValueEnum;
use std::collections::BTreeSet;
use std::path::Path;

/// Prints the jobs of a shard: number, scene, graph or other renderer, settings.
pub fn list(lists: &Lists<'_>, shard: Shard) {
    let mine: Vec<_> = lists.jobs.iter().filter(|job| shard.has(job.number)).collect();
    let mut renders = 0;
    for job in &mine {
        let view = &lists.views[job.view];
        let scene = scene(&view.path, view.camera.as_deref());
        let (what, settings) = match &job.work {
            Work::Graph { graph, settings } => (&lists.graphs[*graph].name, settings.as_slice()),
            Work::Peer(peer) => (&lists.peers[*peer].name, &[][..]),
        };
        renders += settings.len().max(1);
        let settings: Vec<String> = settings.iter().map(shown).collect();
        print(&format!("{:>5}  {scene}  {what}  {}\n", job.number + 1, settings.join(" | ")));
    }
    print(&format!("shard {shard}: {} of {} jobs, {renders} settings\n", mine.len(), lists.jobs.len()));
}

fn scene(path: &Path, camera: Option<&str>) -> String {
    camera.map_or_else(|| path.display().to_string(), |camera| format!("{}:{camera}", path.display()))
}

fn shown(setting: &Setting) -> String {
    let words: Vec<String> = setting.iter().map(|(n, v)| format!("{n}={v}")).collect();
    if words.is_empty() { "its defaults".into() } else { words.join(" ") }
}

/// What tells two benches apart besides their jobs: parts of one may be joined.
pub fn made_of(args: &BenchArgs, lists: &Lists<'_>, commit: Option<String>) -> Vec<String> {
    let scenes = lists.views.iter().map(|view| scene(&view.path, view.camera.as_deref()));
    let graphs = lists.graphs.iter().map(|graph| graph.name.clone());
    let peers = lists.peers.iter().map(|peer| peer.name.clone());
    let BenchArgs { size, phases, repeat, rounds, seconds, brief, patience, fastest, .. } = args;
    let effort = format!("{size:?} {phases:?} {repeat} {rounds} {seconds} {brief} {patience:?} {fastest:?}");
    let program = [env!("CARGO_PKG_VERSION").to_string(), commit.unwrap_or_default(), effort];
    program.into_iter().chain(scenes).chain(graphs).chain(peers).collect()
}

/// Joins parts, writes the results and their page.
///
/// # Errors
/// Parts that are not those of one bench, or not all of them; files that can't be written.
pub fn merge_parts(args: &BenchArgs) -> Result<u8, Failure> {
    let old = args.against.as_deref().map(Results::read).transpose()?;
    let results = merge(&args.merge, &args.out)?;
    results.write(&args.out)?;
    let hosts: BTreeSet<&str> = results.entries.iter().filter_map(|e| Some(e.host.as_ref()?.name.as_str())).collect();
    let (parts, entries) = (args.merge.len(), results.entries.len());
    print(&format!("joined {parts} parts: {entries} entries of {} hosts\n", hosts.len()));
    publish(args, &results, &args.out, old.as_ref())
}

/// Prints a script for `sbatch`: an array of so many parts, each into a folder of its own, which `--merge` joins.
pub fn slurm(args: &BenchArgs, parts: u32) {
    let out = args.out.display().to_string();
    let words: Vec<String> = words(args).iter().map(|w| quoted(w)).collect();
    let folder = quoted(&format!("{}/shard-", out.trim_end_matches('/')));
    print(&format!(
        r#"#!/bin/bash
# `sbatch` of this file measures {parts} parts of a bench, a task each. Add what your site asks for, such as
# --partition, --account, --time and --gres=gpu:1. A task that is run again goes on where it was stopped.
#SBATCH --job-name=lightgraph-bench
#SBATCH --array=1-{parts}
#SBATCH --requeue
# When all are done:
#     lightgraph bench --merge {folder}* --out {whole}
set -euo pipefail
lightgraph bench {words} \
    --shard "$SLURM_ARRAY_TASK_ID/{parts}" --resume --out {folder}"$SLURM_ARRAY_TASK_ID"
"#,
        whole = quoted(&out),
        words = words.join(" ")
    ));
}

/// The options that say what is measured, as the command line takes them.
fn words(args: &BenchArgs) -> Vec<String> {
    let list = |all: &[std::path::PathBuf]| all.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(",");
    let number = |n: f64| n.to_string();
    let [width, height] = args.size;
    let policy = args.fastest.to_possible_value().map(|v| v.get_name().to_string());
    let phases: Vec<&str> = args.phases.iter().map(|p: &Phase| p.word()).collect();
    let mut words = vec![];
    let mut add = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            words.extend([format!("--{name}"), value]);
        }
    };
    add("graphs", Some(list(&args.graphs)));
    add("scenes", Some(args.scenes.join(",")).filter(|s| !s.is_empty()));
    add("sweep", args.sweep.clone());
    add("repeat", Some(args.repeat.to_string()));
    add("seconds", Some(number(args.seconds)));
    add("patience", args.patience.map(number));
    add("rounds", Some(args.rounds.to_string()));
    add("brief", Some(number(args.brief)));
    add("phases", Some(phases.join(",")).filter(|s| !s.is_empty()));
    add("size", Some(format!("{width}x{height}")));
    add("references", Some(args.references.display().to_string()));
    add("peers", args.peers.as_ref().map(|p| p.display().to_string()));
    add("images", Some(args.images.to_string()));
    add("fastest", policy);
    args.shaders.folders.iter().for_each(|f| add("shaders", Some(f.display().to_string())));
    words
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:+@".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::{Cli, Command};
    use clap::Parser;

    fn args(words: &[&str]) -> BenchArgs {
        match Cli::parse_from([&["lightgraph", "bench"], words].concat()).command {
            Command::Bench(args) => args,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_script_s_options_are_those_that_were_given() {
        for given in [
            &[][..],
            &["--graphs", "a b.ron,c.ron", "--scenes", "x:cam,y", "--sweep", "grid=2,(4,2,4);face=8", "--rounds", "3"],
            &["--phases", "still,camera", "--patience", "0.5", "--size", "32x16", "--shaders", "s", "--shaders", "t"],
            &["--peers", "others", "--images", "0", "--fastest", "first", "--brief", "0.15", "--references", "r"],
        ] {
            let args_ = args(given);
            let again = words(&args_);
            let again = args(&again.iter().map(String::as_str).collect::<Vec<_>>());
            assert_eq!(format!("{args_:?}"), format!("{again:?}"));
        }
    }

    #[test]
    fn words_stay_whole_in_a_shell() {
        assert_eq!(quoted("grid=2"), "grid=2");
        assert_eq!(quoted("grid=(2, 3);face=8"), "'grid=(2, 3);face=8'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
    }
}
