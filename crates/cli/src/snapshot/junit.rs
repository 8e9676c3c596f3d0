//! Results as JUnit XML, which CI services read.

use super::{Summary, TestOutcome, TestState};
use std::fmt::Write;

/// The whole file: one suite, a case a test. A test that could not be run in full counts as skipped.
pub fn xml(summary: &Summary) -> String {
    let (all, failed, skipped) =
        (summary.outcomes.len(), summary.count(TestState::Failed), summary.count(TestState::NotRun));
    let seconds: f64 = summary.outcomes.iter().map(|o| o.seconds).sum();
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    // Writing to a string can't fail.
    let _ = writeln!(
        out,
        "<testsuite name=\"lightgraph\" tests=\"{all}\" failures=\"{failed}\" errors=\"0\" skipped=\"{skipped}\" time=\"{seconds:.3}\">"
    );
    summary.outcomes.iter().for_each(|o| case(&mut out, o));
    out + "</testsuite>\n"
}

fn case(out: &mut String, outcome: &TestOutcome) {
    let (name, file) = (escaped(&outcome.name), escaped(&outcome.path.display().to_string()));
    let _ = write!(
        out,
        "  <testcase classname=\"lightgraph\" name=\"{name}\" file=\"{file}\" time=\"{:.3}\"",
        outcome.seconds
    );
    let body: String = match outcome.state() {
        TestState::Passed => String::new(),
        TestState::Failed => {
            let titles: Vec<&str> = outcome.failures.iter().map(|f| f.title.as_str()).collect();
            let message = escaped(&titles.join(", "));
            format!("    <failure message=\"{message}\">{}</failure>\n", escaped(&outcome.to_string()))
        }
        TestState::NotRun => {
            format!("    <skipped message=\"no adapter for: {}\"/>\n", escaped(&outcome.not_run.join(", ")))
        }
    };
    let _ = match body.is_empty() {
        true => writeln!(out, "/>"),
        false => writeln!(out, ">\n{body}  </testcase>"),
    };
}

/// Text for XML and HTML. Characters that XML 1.0 has no place for become question marks.
pub fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(c),
            c if c.is_control() => out.push('?'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{FailedCheck, Summary, TestOutcome};
    use super::*;

    /// One that passes, one that fails, one that was not run.
    pub fn sample() -> Summary {
        let outcome = |name: &str| TestOutcome {
            name: name.into(),
            path: format!("{name}.ron").into(),
            about: "About <this>.".into(),
            seconds: 0.25,
            held: vec!["plan".into()],
            failures: vec![],
            blessed: vec![],
            not_run: vec![],
        };
        let failure = FailedCheck {
            title: "mean of `color`".into(),
            why: "0.5 < 1 & so on".into(),
            reason: "half".into(),
            pictures: vec![],
            blessable: false,
        };
        let failed = TestOutcome { failures: vec![failure], ..outcome("b") };
        let not_run = TestOutcome { not_run: vec!["steps".into()], ..outcome("c") };
        Summary { outcomes: vec![outcome("a"), failed, not_run], ..Summary::default() }
    }

    #[test]
    fn every_state_has_its_element() {
        let text = xml(&sample());
        assert!(text.contains("tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"1\" time=\"0.750\""), "{text}");
        assert!(text.contains("name=\"a\" file=\"a.ron\" time=\"0.250\"/>"), "{text}");
        assert!(text.contains("<failure message=\"mean of `color`\">"), "{text}");
        assert!(text.contains("0.5 &lt; 1 &amp; so on"), "{text}");
        assert!(text.contains("<skipped message=\"no adapter for: steps\"/>"), "{text}");
        assert_eq!(text.matches("<testcase").count(), 3);
        assert_eq!(text.matches("</testcase>").count(), 2);
    }

    #[test]
    fn counts_tell_the_states_apart() {
        let shown = sample().to_string();
        assert!(shown.ends_with("1 passed, 1 failed, 1 not run in full\n"), "{shown}");
        assert!(!sample().passed());
        assert!(!Summary::default().passed(), "no test is no success");
    }
}
