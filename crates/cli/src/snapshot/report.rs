//! Results as one page without outside files: counts, every test, and the images of those that failed, one over the
//! other with a slider between them.

use super::junit::escaped;
use super::{FailedCheck, Summary, TestOutcome, TestState};
use crate::base64::base64;
use lightgraph::internals::files;
use lightgraph::{Checked, Diagnostic};
use std::fmt::Write;
use std::path::Path;

const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// The page.
///
/// # Errors
/// An image of a failed test can't be read.
pub fn html(summary: &Summary) -> Checked<String> {
    let (passed, failed, not_run) =
        (summary.count(TestState::Passed), summary.count(TestState::Failed), summary.count(TestState::NotRun));
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <title>{failed} failed, {passed} passed</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <h1>{passed} passed, {failed} failed, {not_run} not run in full</h1>\n"
    );
    if let Some(adapter) = &summary.adapter {
        // Writing to a string can't fail.
        let _ = writeln!(out, "<p>on {}</p>", escaped(adapter));
    }
    if let Some(d) = &summary.no_adapter {
        let _ = writeln!(out, "<p>{}</p>", escaped(&d.message));
    }
    let order = [TestState::Failed, TestState::NotRun, TestState::Passed];
    for state in order {
        for outcome in summary.outcomes.iter().filter(|o| o.state() == state) {
            test(&mut out, outcome)?;
        }
    }
    let _ = writeln!(out, "<script>\n{SCRIPT}</script>\n</body>\n</html>");
    Ok(out)
}

fn test(out: &mut String, outcome: &TestOutcome) -> Checked<()> {
    let (class, word) = match outcome.state() {
        TestState::Passed => ("passed", "passed"),
        TestState::Failed => ("failed", "failed"),
        TestState::NotRun => ("not-run", "not run in full"),
    };
    let _ = writeln!(
        out,
        "<section class=\"{class}\">\n<h2>{} <small>{word}, {:.1} s</small></h2>\n<p>{}</p>",
        escaped(&outcome.name),
        outcome.seconds,
        escaped(&outcome.about)
    );
    for failure in &outcome.failures {
        failed(out, failure)?;
    }
    let lists = [("holds", &outcome.held), ("blessed", &outcome.blessed), ("needs an adapter", &outcome.not_run)];
    for (what, titles) in lists.iter().filter(|l| !l.1.is_empty()) {
        let _ = writeln!(out, "<p class=\"{what}\">{what}: {}</p>", escaped(&titles.join(", ")));
    }
    out.push_str("</section>\n");
    Ok(())
}

fn failed(out: &mut String, failure: &FailedCheck) -> Checked<()> {
    let _ = writeln!(out, "<h3>{}</h3>\n<pre>{}</pre>", escaped(&failure.title), escaped(&failure.why));
    if !failure.reason.is_empty() {
        let _ = writeln!(out, "<p>The limit’s reason: {}</p>", escaped(&failure.reason));
    }
    if failure.pictures.is_empty() {
        return Ok(());
    }
    let mut images = vec![];
    for picture in &failure.pictures {
        images.push((picture.name, source(&picture.png)?));
    }
    let find = |name: &str| images.iter().find(|(n, _)| *n == name).map(|(_, s)| s);
    out.push_str("<div class=\"pictures\">\n");
    if let (Some(actual), Some(expected)) = (find("actual"), find("expected")) {
        let _ = writeln!(
            out,
            "<figure class=\"pair\"><div><img alt=\"expected\" src=\"{expected}\"><img class=\"over\" alt=\"actual\" \
             src=\"{actual}\"></div><input type=\"range\" min=\"0\" max=\"100\" value=\"50\" aria-label=\"share of \
             the actual image\"><button type=\"button\">flicker</button><figcaption>left of the line: actual; right: \
             expected</figcaption></figure>"
        );
    }
    for (name, source) in &images {
        let _ = writeln!(out, "<figure><img alt=\"{name}\" src=\"{source}\"><figcaption>{name}</figcaption></figure>");
    }
    out.push_str("</div>\n");
    Ok(())
}

/// A PNG file as the source of an `img`.
fn source(path: &Path) -> Checked<String> {
    let bytes = files::read(path, files::IMAGE)
        .map_err(|e| Diagnostic::error(format!("can't read {}: {e}", path.display())))?;
    Ok(format!("data:image/png;base64,{}", base64(&bytes)))
}

#[cfg(test)]
mod tests {
    use super::super::junit::tests::sample;
    use super::*;

    #[test]
    fn failed_tests_come_first_and_texts_are_escaped() {
        let page = html(&sample()).unwrap();
        let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text} is missing in\n{page}"));
        assert!(place("<h2>b ") < place("<h2>c ") && place("<h2>c ") < place("<h2>a "));
        place("About &lt;this&gt;.");
        place("0.5 &lt; 1 &amp; so on");
        assert!(!page.contains("http://") && !page.contains("https://"), "the page asks for outside files");
    }
}
