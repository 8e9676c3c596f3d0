//! One test: plays what its checks need and judges them in order.

use super::check::{self, Check, CheckKind};
use super::file::{ScriptRun, Setup, Test};
use super::play::{Played, plan_in_the_end, play};
use super::reference::{Compared, ReferenceFiles, failure, flat};
use super::{FailedCheck, TestOptions, TestOutcome};
use lightgraph::internals::graph::ast::Name;
use lightgraph::{Checked, Gpu, Image};
use std::sync::atomic::AtomicBool;

/// Judges every check that can be run here. Nothing is written once it is too late.
pub fn judge(test: &Test, gpu: Option<&Gpu>, options: &TestOptions, late: &AtomicBool, outcome: &mut TestOutcome) {
    let name = outcome.name.clone();
    let files = ReferenceFiles { test, name: &name, options, late };
    let mut played: Option<Played> = None;
    // Files that can't be used, and devices that are lost, fail every check that renders in the same way.
    let mut hopeless = false;
    for check in &test.checks {
        if options.fail_fast && !outcome.failures.is_empty() {
            break;
        }
        let title = check.kind.title();
        if check.kind.renders() && gpu.is_none() {
            outcome.not_run.push(title);
            continue;
        }
        if check.kind.renders() && hopeless {
            continue;
        }
        let result = match (&check.kind, gpu) {
            (CheckKind::Plan, _) => plan_in_the_end(&test.start, &test.steps)
                .and_then(|plan| files.text("plan.txt", &title, &plan.to_string())),
            (CheckKind::Bytes { at_most }, _) => {
                plan_in_the_end(&test.start, &test.steps).map(|plan| compared(&title, check::bytes(&plan, *at_most)))
            }
            (_, Some(gpu)) => with_frames(test, gpu, check, &files, &mut played),
            (_, None) => continue,
        };
        match result {
            Ok(Compared::Equal) => outcome.held.push(title),
            Ok(Compared::Blessed(what)) => outcome.blessed.push(what),
            Ok(Compared::Differs(failure)) => {
                outcome.failures.push(FailedCheck { reason: check.reason.clone(), ..failure });
            }
            Err(faults) => {
                outcome.fail(&title, &faults);
                hopeless |= played.is_none() && check.kind.renders();
            }
        }
    }
}

fn with_frames(
    test: &Test,
    gpu: &Gpu,
    check: &Check,
    files: &ReferenceFiles,
    played: &mut Option<Played>,
) -> Checked<Compared> {
    let title = check.kind.title();
    let outputs = outputs(test);
    if matches!(check.kind, CheckKind::Incremental) {
        return Ok(compared(&title, incremental(test, gpu, &outputs)?));
    }
    let first = match played.take() {
        Some(first) => first,
        None => play(gpu, &test.start, &test.steps, &outputs, false)?,
    };
    let first = played.insert(first);
    let image = |output: &Name| image(first, output);
    let other = |run: &ScriptRun, output: &Name| another(test, gpu, run.of(&test.start), output);
    Ok(match &check.kind {
        CheckKind::Image { output, limits, per_adapter } => {
            let stem = match per_adapter {
                true => format!("{}.{}", output.value, slug(&gpu.info.name)),
                false => output.value.clone(),
            };
            files.image(&stem, &title, image(output)?, limits)?
        }
        CheckKind::Steps { ran, skipped } => compared(&title, check::steps(first, ran, skipped)),
        CheckKind::Iterations { name, min, max } => compared(&title, check::iterations(first, name, *min, *max)),
        CheckKind::Mean { output, value, tolerance } => {
            compared(&title, check::mean(image(output)?, *value, *tolerance))
        }
        CheckKind::Constant { output, value, tolerance } => {
            compared(&title, check::constant(image(output)?, *value, *tolerance))
        }
        CheckKind::Symmetric { output, axis, limits } => {
            let actual = image(output)?;
            let expected = check::mirrored(actual, *axis);
            let stem = format!("{}.mirrored", output.value);
            shown(files, &stem, &title, limits.hold(actual, &expected), actual, &expected)?
        }
        CheckKind::NotBrighter { output, than, slack } => {
            let (actual, expected) = (image(output)?, other(than, output)?);
            let stem = format!("{}.other", output.value);
            shown(files, &stem, &title, check::not_brighter(actual, &expected, *slack), actual, &expected)?
        }
        CheckKind::Times { output, factor, of, limits } => {
            let (actual, expected) = (image(output)?, check::scaled(&other(of, output)?, *factor));
            let stem = format!("{}.times", output.value);
            shown(files, &stem, &title, limits.hold(actual, &expected), actual, &expected)?
        }
        CheckKind::Plan | CheckKind::Bytes { .. } | CheckKind::Incremental => Compared::Equal,
    })
}

/// The outputs that the checks look at, each once.
fn outputs(test: &Test) -> Vec<Name> {
    let mut outputs: Vec<Name> = vec![];
    for output in test.checks.iter().filter_map(|c| c.kind.output()) {
        if !outputs.iter().any(|o| o.value == output.value) {
            outputs.push(output.clone());
        }
    }
    outputs
}

/// Plays with every frame verified. A difference is the check's failure; other faults are found by playing without.
fn incremental(test: &Test, gpu: &Gpu, outputs: &[Name]) -> Checked<Result<(), String>> {
    match play(gpu, &test.start, &test.steps, outputs, true) {
        Ok(_) => Ok(Ok(())),
        Err(faults) => {
            play(gpu, &test.start, &test.steps, outputs, false)?;
            Ok(Err(faults.0.iter().map(|d| d.message.as_str()).collect::<Vec<_>>().join("\n")))
        }
    }
}

fn another(test: &Test, gpu: &Gpu, setup: Setup, output: &Name) -> Checked<Image> {
    let played = play(gpu, &setup, &test.steps, std::slice::from_ref(output), false)?;
    image(&played, output).cloned()
}

fn image<'a>(played: &'a Played, output: &Name) -> Checked<&'a Image> {
    played.images.get(&output.value).ok_or_else(|| {
        let d = lightgraph::Diagnostic::error(format!("`{}` was not rendered", output.value));
        d.at(&output.span, "").into()
    })
}

fn compared(title: &str, result: Result<(), String>) -> Compared {
    match result {
        Ok(()) => Compared::Equal,
        Err(why) => Compared::Differs(FailedCheck { blessable: false, ..failure(title, why, vec![]) }),
    }
}

/// A failure with pictures of what was compared.
fn shown(
    files: &ReferenceFiles,
    stem: &str,
    title: &str,
    result: Result<(), String>,
    actual: &Image,
    expected: &Image,
) -> Checked<Compared> {
    let Err(why) = result else { return Ok(Compared::Equal) };
    let pictures = files.pictures(stem, &flat(actual)?, Some(&flat(expected)?))?;
    Ok(Compared::Differs(FailedCheck { blessable: false, ..failure(title, why, pictures) }))
}

/// A name as part of a file's name.
fn slug(name: &str) -> String {
    let words = name.to_lowercase();
    let words = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.collect::<Vec<_>>().join("-")
}
