//! Mutants of every kind of file, as `fuzz/` knows them: each is refused with an error or read, within memory and time.
//!
//! A process with 4 GiB of addresses takes each kind; what ends it fails the test with the mutant, kept in
//! `target/tmp/mutants`. `LIGHTGRAPH_MUTANTS` says how many of each kind (`make mutants`: 2,000); without it, as many
//! as `make test` has time for.

use crate::support::{Random, files, repository};
use lightgraph::internals::shader::{Defs, Library, compose};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

#[path = "../../fuzz/src/targets.rs"]
mod targets;

/// Mutants of each kind, where nobody says how many.
const USUAL: usize = 200;

/// Longer than this no file of these sizes may take, on however busy a machine.
const PATIENCE: Duration = Duration::from_secs(30);

/// KiB of addresses.
const MEMORY: u32 = 4 << 20;

/// Which kind a process is to take.
const KIND: &str = "LIGHTGRAPH_MUTANTS_OF";

/// What is done with the bytes of a file.
type Target = fn(&[u8]);

const KINDS: [(&str, Target); 10] = [
    ("graph", targets::graph),
    ("variant", targets::variant),
    ("plan", targets::plan),
    ("wgsl", targets::wgsl),
    ("gltf", targets::gltf),
    ("scene", targets::scene),
    ("test", targets::test),
    ("image", targets::image),
    ("results", targets::results),
    ("cache", targets::cache),
];

#[test]
fn mutants_are_refused_or_read_within_memory_and_time() {
    let count = count();
    println!("{count} mutants of each kind; `make mutants` takes 2,000");
    let mut failures = String::new();
    for (kind, _) in KINDS {
        let limited = format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"");
        let mut command = Command::new("sh");
        command.args(["-c", &limited]).arg(std::env::current_exe().unwrap());
        command.args(["--exact", "mutants::one_kind", "--ignored", "--nocapture"]).env(KIND, kind);
        let output = command.output().unwrap();
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr);
            let tail: Vec<&str> = text.lines().rev().take(30).collect();
            let tail: Vec<&str> = tail.into_iter().rev().collect();
            failures += &format!("{kind}: {}\n{}\n\n", output.status, tail.join("\n"));
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

fn count() -> usize {
    std::env::var("LIGHTGRAPH_MUTANTS").ok().and_then(|n| n.parse().ok()).unwrap_or(USUAL)
}

#[test]
#[ignore = "takes one kind of file in a process of its own, which the test above starts"]
fn one_kind() {
    let wanted = std::env::var(KIND).unwrap_or_else(|_| panic!("{KIND} names no kind"));
    let (kind, target) = KINDS.into_iter().find(|k| k.0 == wanted).unwrap();
    let seeds = seeds(kind);
    let mut random = Random(u64::from_le_bytes(*b"mutants!"));
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutants");
    std::fs::create_dir_all(&kept).unwrap();
    let file = kept.join(kind);
    for number in 0..count() {
        let mutant = mutant(&seeds, &mut random);
        // What ends the process is there to be looked at.
        std::fs::write(&file, &mutant).unwrap();
        let start = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| target(&mutant)));
        let took = start.elapsed();
        assert!(result.is_ok(), "mutant {number} of {kind} panics: {}", file.display());
        assert!(took < PATIENCE, "mutant {number} of {kind} takes {took:?}: {}", file.display());
    }
    std::fs::remove_file(&file).unwrap();
}

/// Sound files of a kind.
fn seeds(kind: &str) -> Vec<Vec<u8>> {
    let read = |paths: Vec<PathBuf>| -> Vec<Vec<u8>> {
        let all = paths.iter().map(|p| std::fs::read(p).unwrap());
        all.filter(|bytes| bytes.len() < 100_000).collect()
    };
    match kind {
        "graph" | "plan" => read(files("graphs/gi", &["ron"])),
        "variant" => read(files("graphs/gi", &["ron"])).iter().filter_map(|bytes| edits(bytes)).collect(),
        "wgsl" => read([files("shaders", &["wgsl"]), files("shaders/lib", &["wgsl"])].concat()),
        "gltf" => read(files("scenes", &["gltf", "glb"])),
        "scene" => read(files("scenes", &["ron"])),
        "test" => read(files("tests/graphs", &["ron"])),
        "image" => read(files("fuzz/seeds", &["exr"])),
        "results" => read(files("fuzz/seeds", &["json", "gz"])),
        _ => modules(),
    }
}

/// What a variant says after the name of its base.
fn edits(variant: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(variant).ok()?.strip_prefix("Variant(")?;
    let (_, after) = text.split_once("base: ")?;
    Some(after.split_once(',')?.1.rsplit_once(')')?.0.into())
}

/// Joined shaders as the cache keeps them.
fn modules() -> Vec<Vec<u8>> {
    let library = Library::load(&[repository("shaders")]).unwrap();
    let small = library.files.iter().filter(|(path, source)| !path.contains('/') && source.text.len() < 3000);
    let composed = small.filter_map(|(path, _)| compose(&library, path, &Defs::new(), &[]).ok());
    let modules: Vec<_> = composed.map(|shader| postcard::to_allocvec(&shader.module).unwrap()).collect();
    assert!(modules.len() > 3, "too few shaders compose without definitions");
    modules
}

/// A sound file with some damage: bits, bytes, lengths, numbers, pieces of others, pieces a thousand times.
fn mutant(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    const WORDS: [&[u8]; 14] = [
        b"-1",
        b"0",
        b"4294967295",
        b"4294967296",
        b"1e999",
        b"NaN",
        b"\"",
        b"(",
        b"[",
        b"\xff\xff\xff\xff",
        b"\x00\x00\x00\x80",
        b"..",
        b"\\u202e",
        b"9223372036854775807",
    ];
    let mut bytes = seeds[random.below(seeds.len())].clone();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len());
        let length = 1 + random.below(64.min(bytes.len() + 1 - at));
        let end = (at + length).min(bytes.len());
        match random.below(9) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            1 if !bytes.is_empty() => bytes[at] = random.below(256) as u8,
            2 => drop(bytes.drain(at..end)),
            3 => {
                let piece = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            4 => {
                let other = &seeds[random.below(seeds.len())];
                let from = random.below(other.len());
                let piece = other[from..(from + length).min(other.len())].to_vec();
                bytes.splice(at..end, piece);
            }
            5 => {
                let piece = bytes[at..end].repeat(1000);
                bytes.splice(at..at, piece);
            }
            6 => bytes.truncate(at),
            // A number, where there is one behind this place.
            7 => {
                let digit = |b: &u8| b.is_ascii_digit();
                let start = bytes[at..].iter().position(digit).map_or(at, |i| at + i);
                let end = bytes[start..].iter().position(|b| !digit(b)).map_or(bytes.len(), |i| start + i);
                bytes.splice(start..end, WORDS[random.below(6)].iter().copied());
            }
            _ => drop(bytes.splice(at..end, WORDS[random.below(WORDS.len())].iter().copied())),
        }
    }
    bytes
}
