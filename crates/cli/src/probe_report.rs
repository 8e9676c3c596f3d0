//! What an invocation that was asked computes, in sections for people: the command prints them, the window shows them.

use lightgraph::internals::shader::Stage;
use lightgraph::internals::shader::probe::{Invocation, Probe, RUNS, Reading, Role, Site};
use lightgraph::{Checked, Diagnostic, Gpu, Session};
use std::fmt;

/// What the invocations at a place of a step did.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeReport {
    pub step: String,
    /// The shader's file.
    pub shader: String,
    pub at: [u32; 3],
    /// How many invocations there were.
    pub count: u32,
    /// The last of them.
    pub invocations: Vec<Vec<ProbeSection>>,
    /// Values that found no room in the probe's buffer.
    pub left_out: usize,
}

/// Values of one kind, or of one function.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeSection {
    pub title: String,
    /// Names and values.
    pub rows: Vec<(String, String)>,
}

impl ProbeReport {
    /// Reads what the frame since [`Session::probe`] answered.
    ///
    /// # Errors
    /// The session probes nothing, nothing ran at the place, or the device fails.
    pub fn read(session: &Session, gpu: &Gpu, at: [u32; 3]) -> Checked<ProbeReport> {
        let (count, invocations) = session.probed(gpu)?;
        let (step, probe) = session.probe_sites()?;
        let step = session.plan.steps.get(step.0).map_or(String::new(), |s| s.name.clone());
        if invocations.is_empty() {
            let [x, y, z] = at;
            let d = Diagnostic::error(format!("no invocation of `{step}` ran at {x},{y},{z}"));
            let help = "nothing is drawn or dispatched there; `--output NAME=FILE` of `render` shows what is";
            return Err(d.help(help).into());
        }
        let shader = probe.shader.path.clone();
        let invocations = invocations.iter().map(|i| sections(probe, i)).collect();
        Ok(ProbeReport { step, shader, at, count, invocations, left_out: probe.left_out })
    }

    /// The number of an invocation among all that ran, from 1.
    pub fn number(&self, shown: usize) -> usize {
        (self.count as usize).saturating_sub(self.invocations.len()) + shown + 1
    }

    /// The step, its shader and the place.
    pub fn title(&self) -> String {
        let [x, y, z] = self.at;
        format!("`{}`, {}, at {x},{y},{z}", self.step, self.shader)
    }
}

impl fmt::Display for ProbeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title())?;
        if self.count > RUNS {
            writeln!(f, "{} invocations; the last {RUNS}:", self.count)?;
        }
        for (i, sections) in self.invocations.iter().enumerate() {
            if self.invocations.len() > 1 {
                writeln!(f, "\ninvocation {} of {}", self.number(i), self.count)?;
            }
            for ProbeSection { title, rows } in sections {
                let width = rows.iter().map(|r| r.0.chars().count()).max().unwrap_or(0).min(40);
                writeln!(f, "{title}")?;
                for (name, value) in rows {
                    writeln!(f, "  {name:width$}  {value}")?;
                }
            }
        }
        if self.left_out > 0 {
            writeln!(f, "{} values found no room; choose with `--value NAME`", self.left_out)?;
        }
        Ok(())
    }
}

/// What an invocation did.
fn sections(probe: &Probe, invocation: &Invocation) -> Vec<ProbeSection> {
    let read: Vec<(&Site, &Reading)> = invocation.readings.iter().map(|r| (&probe.sites[r.site], r)).collect();
    let of = |role: Role| rows(read.iter().copied().filter(|(site, _)| site.role == role));
    let mut all = vec![("inputs".to_string(), of(Role::Argument))];
    all.push(("uniforms".into(), of(Role::Uniform)));
    all.push(("reads".into(), of(Role::Read)));
    let values: Vec<(&Site, &Reading)> =
        read.iter().copied().filter(|(site, _)| matches!(site.role, Role::Let | Role::Var)).collect();
    let mut functions: Vec<&str> = vec![];
    for (site, _) in &values {
        if !functions.contains(&site.function.as_str()) {
            functions.push(&site.function);
        }
    }
    for function in functions {
        let own = values.iter().copied().filter(|(site, _)| site.function == function);
        all.push((format!("values of `{function}`"), rows(own)));
    }
    all.push(("writes".into(), of(Role::Write)));
    let mut returned = of(Role::Return);
    let returns = probe.sites.iter().any(|s| s.role == Role::Return);
    if probe.stage == Stage::Fragment && returns && returned.is_empty() {
        returned.push(("none: the fragment was discarded".into(), String::new()));
    }
    all.push(("output".into(), returned));
    let all = all.into_iter().filter(|(_, rows)| !rows.is_empty());
    all.map(|(title, rows)| ProbeSection { title, rows }).collect()
}

/// A row for each value of each site; the last says how often the site was reached.
fn rows<'a>(readings: impl Iterator<Item = (&'a Site, &'a Reading)>) -> Vec<(String, String)> {
    let mut rows = vec![];
    for (site, reading) in readings {
        rows.extend(reading.words.iter().map(|words| site.show(words)));
        if let (Some((_, value)), true) = (rows.last_mut(), reading.count > 1 && !reading.words.is_empty()) {
            value.push_str(&format!("   the last of {}", reading.count));
        }
    }
    rows
}
