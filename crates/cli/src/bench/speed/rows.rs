//! What was measured, line by line.

use crate::bench::host::Machine;
use lightgraph::Checked;
use lightgraph::internals::image::file::write_atomically;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// One figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpeedRow {
    /// The heading it stands under.
    pub section: String,
    pub name: String,
    pub value: f64,
    pub unit: String,
    /// `None`: it is told, not judged.
    pub wanted: Option<Goal>,
    /// What it comes from.
    pub note: String,
}

/// What a figure is held to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Goal {
    AtLeast(f64),
    AtMost(f64),
}

impl SpeedRow {
    /// A figure that is not judged.
    pub fn new(section: &str, name: impl Into<String>, value: f64, unit: &str) -> SpeedRow {
        let (section, unit) = (section.to_string(), unit.to_string());
        SpeedRow { section, name: name.into(), value, unit, wanted: None, note: String::new() }
    }

    #[must_use]
    pub fn wanted(self, wanted: Goal) -> SpeedRow {
        SpeedRow { wanted: Some(wanted), ..self }
    }

    #[must_use]
    pub fn note(self, note: impl Into<String>) -> SpeedRow {
        SpeedRow { note: note.into(), ..self }
    }

    /// Whether it is what it is held to; `None` when it is held to nothing.
    pub fn met(&self) -> Option<bool> {
        self.wanted.map(|w| match w {
            Goal::AtLeast(least) => self.value >= least,
            Goal::AtMost(most) => self.value <= most,
        })
    }

    fn judged(&self) -> (String, &'static str) {
        let wanted = match self.wanted {
            Some(Goal::AtLeast(x)) => format!("≥ {x}"),
            Some(Goal::AtMost(x)) => format!("≤ {x}"),
            None => String::new(),
        };
        (wanted, self.met().map_or("", |met| if met { "met" } else { "missed" }))
    }

    fn figure(&self) -> String {
        let digits = if self.value.abs() >= 100.0 { 0 } else { 3 };
        format!("{:.digits$} {}", self.value, self.unit).trim_end().to_string()
    }
}

/// A run's figures and what they were measured on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpeedRows {
    pub version: String,
    pub commit: Option<String>,
    pub machine: Machine,
    pub rows: Vec<SpeedRow>,
}

/// One figure as a line of a table.
pub fn line(row: &SpeedRow) -> String {
    let (wanted, met) = row.judged();
    let name = format!("{}: {}", row.section, row.name);
    let gap = if row.note.is_empty() { "" } else { "  " };
    format!("{name:58} {:>14}  {wanted:8} {met:6}{gap}{}\n", row.figure(), row.note)
}

impl SpeedRows {
    /// Writes `speed.json` and `speed.html` to a folder.
    ///
    /// # Errors
    /// They can't be written.
    pub fn write(&self, folder: &Path) -> Checked<()> {
        let json = serde_json::to_string_pretty(self)
            .map_err(|e| lightgraph::Diagnostic::error(format!("the figures can't be written as JSON: {e}")))?;
        write_atomically(&folder.join("speed.json"), json.as_bytes())?;
        write_atomically(&folder.join("speed.html"), self.html().as_bytes())
    }

    fn html(&self) -> String {
        let mut page = String::from(concat!(
            "<!doctype html><meta charset=\"utf-8\"><title>How fast</title><style>",
            "body{font:15px sans-serif;margin:2em auto;max-width:75em}td,th{padding:.2em .8em;text-align:left}",
            "td:nth-child(2){text-align:right}.missed{color:#b00}.met{color:#070}</style><h1>How fast</h1>",
        ));
        let m = &self.machine;
        let kind = if m.software { "a software driver: no time here is a GPU's" } else { "hardware" };
        let on = format!("{} ({kind}), {}, {} cores, {}", m.adapter, m.cpu, m.cores, m.os);
        let version = format!("{} {}", self.version, self.commit.as_deref().unwrap_or(""));
        let _ = write!(page, "<p>{}<br>lightgraph {}</p>", escape(&on), escape(version.trim()));
        let mut section = "";
        for row in &self.rows {
            if row.section != section {
                let close = if section.is_empty() { "" } else { "</table>" };
                section = &row.section;
                let _ = write!(page, "{close}<h2>{}</h2><table>", escape(section));
            }
            let (wanted, met) = row.judged();
            let cells = [&row.name, &row.figure(), &wanted].map(|t| format!("<td>{}</td>", escape(t))).concat();
            let note = escape(&row.note);
            let _ = write!(page, "<tr>{cells}<td class=\"{met}\">{met}</td><td>{note}</td></tr>");
        }
        page + "</table>\n"
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
