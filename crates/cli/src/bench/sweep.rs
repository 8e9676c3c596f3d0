//! Settings to try: `grid=2,4,8;face=8,16` is the product of its axes.

use lightgraph::{Checked, Diagnostic, Faults};

/// Axes of parameters, in the order written.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sweep {
    pub axes: Vec<SweepAxis>,
}

/// A parameter and the values it takes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SweepAxis {
    pub name: String,
    /// As `--set NAME=VALUE` takes them.
    pub values: Vec<String>,
}

/// Settings a graph has at most: more is a slip, and would take days.
pub const MOST_SETTINGS: usize = 10_000;

impl Sweep {
    /// Reads `NAME=VALUE,VALUE;NAME=VALUE`. A vector's components stand in parentheses: `grid=4,(4,2,4)`.
    ///
    /// # Errors
    /// Axes without a name or a value, and names that stand twice; all at once.
    pub fn parse(text: &str) -> Checked<Sweep> {
        let mut sweep = Sweep::default();
        let mut faults = vec![];
        for part in text.split(';').map(str::trim).filter(|p| !p.is_empty()) {
            let (name, values) = part.split_once('=').unwrap_or((part, ""));
            let (name, values) = (name.trim(), split(values));
            if name.is_empty() || values.is_empty() || values.iter().any(String::is_empty) {
                let d = Diagnostic::error(format!("`{part}` is not NAME=VALUE,VALUE…"));
                faults.push(d.help("write it as in --sweep \"grid=2,4,8;face=8,16\""));
            } else if sweep.axes.iter().any(|a| a.name == name) {
                faults.push(Diagnostic::error(format!("the sweep names `{name}` twice")));
            } else {
                sweep.axes.push(SweepAxis { name: name.to_string(), values });
            }
        }
        let settings = sweep.axes.iter().try_fold(1usize, |n, a| n.checked_mul(a.values.len()));
        if settings.is_none_or(|n| n > MOST_SETTINGS) {
            faults.push(Diagnostic::error(format!("the sweep makes more than {MOST_SETTINGS} settings")));
        }
        Faults::check(faults, sweep)
    }

    /// The settings for a graph: axes it doesn't declare are left out; the last axis changes fastest. Without any axis
    /// there is one setting, the graph's own.
    pub fn settings(&self, declares: impl Fn(&str) -> bool) -> Vec<Vec<(String, String)>> {
        let mut all = vec![vec![]];
        for axis in self.axes.iter().filter(|a| declares(&a.name)) {
            let with = |setting: &Vec<(String, String)>, value: &String| {
                let mut longer = setting.clone();
                longer.push((axis.name.clone(), value.clone()));
                longer
            };
            all = all.iter().flat_map(|s| axis.values.iter().map(move |v| with(s, v))).collect();
        }
        all
    }

    /// True of settings that are as far or farther along every axis than another.
    pub fn is_more(&self, setting: &[(String, String)], than: &[(String, String)]) -> bool {
        let place = |(name, value): &(String, String)| {
            let axis = self.axes.iter().find(|a| a.name == *name)?;
            axis.values.iter().position(|v| v == value)
        };
        setting.iter().zip(than).all(|(a, b)| place(a) >= place(b))
    }
}

/// Splits at the commas outside of parentheses.
fn split(text: &str) -> Vec<String> {
    let mut depth = 0i32;
    let mut parts = vec![String::new()];
    for c in text.chars() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        match parts.last_mut() {
            Some(part) if c != ',' || depth > 0 => part.push(c),
            _ => parts.push(String::new()),
        }
    }
    parts.iter().map(|p| p.trim().to_string()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(setting: &[(String, String)]) -> Vec<(&str, &str)> {
        setting.iter().map(|(n, v)| (n.as_str(), v.as_str())).collect()
    }

    #[test]
    fn the_product_runs_over_what_a_graph_declares() {
        let sweep = Sweep::parse(" grid = 2, (4,2,4) ; face=8,16;samples=1").unwrap();
        let all = sweep.settings(|n| n != "samples");
        assert_eq!(all.len(), 4);
        assert_eq!(pairs(&all[1]), [("grid", "2"), ("face", "16")]);
        assert_eq!(pairs(&all[2]), [("grid", "(4,2,4)"), ("face", "8")]);
        assert_eq!(sweep.settings(|_| false), [vec![]]);
    }

    #[test]
    fn more_is_more_of_everything() {
        let sweep = Sweep::parse("grid=2,(4,2,4),8;face=8,16").unwrap();
        let all = sweep.settings(|_| true);
        let more = |than: usize| (0..6).filter(|i| sweep.is_more(&all[*i], &all[than])).collect::<Vec<_>>();
        assert_eq!(more(2), [2, 3, 4, 5], "(4,2,4) and 8");
        assert_eq!(more(3), [3, 5], "(4,2,4) and 16");
    }

    #[test]
    fn an_empty_sweep_is_one_setting() {
        assert_eq!(Sweep::parse("").unwrap().settings(|_| true), [vec![]]);
    }

    #[test]
    fn every_slip_is_named() {
        let faults = Sweep::parse("grid;=2;face=8,;bounces=1;bounces=2").unwrap_err();
        assert_eq!(faults.0.len(), 4, "{faults}");
        assert!(faults.0[3].message.contains("`bounces` twice"));
        let many: Vec<String> = (0..30).map(|i| format!("p{i}=1,2")).collect();
        assert!(Sweep::parse(&many.join(";")).is_err());
    }
}
