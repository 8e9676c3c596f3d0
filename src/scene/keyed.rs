//! Parameters of graphs that change with time, as the scene file says.

use super::motion::within;
use crate::diag::Span;

/// Keyframes of a parameter. The scene file does not know which graph shows it, so the name may be unknown there.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyedParam {
    pub name: String,
    /// Seconds, and the value as the command line writes it; in the order of time, at least one.
    pub keys: Vec<(f32, String)>,
    /// Of the keyframes.
    pub span: Span,
}

impl KeyedParam {
    /// When the last keyframe is; then they begin anew.
    pub fn period(&self) -> f32 {
        self.keys.last().map_or(0.0, |k| k.0)
    }

    /// The keyframes round a time in seconds, and how far it is from the first of the two to the second, 0 to 1.
    pub fn around(&self, time: f32) -> (usize, usize, f32) {
        let time = if time.is_finite() { within(time, self.period()) } else { 0.0 };
        let next = self.keys.partition_point(|k| k.0 <= time);
        let last = self.keys.len().saturating_sub(1);
        let (a, b) = (next.saturating_sub(1), next.min(last));
        let (from, to) = (self.keys[a].0, self.keys[b].0);
        (a, b, if to > from { ((time - from) / (to - from)).max(0.0) } else { 0.0 })
    }
}

#[test]
fn keyframes_are_found_by_time() {
    let source = crate::diag::Source::new("a.ron", "");
    let keys = [0.5, 1.0, 3.0].map(|t| (t, String::new())).to_vec();
    let keyed = KeyedParam { name: "a".into(), keys, span: Span::new(&source, 0..0) };
    assert_eq!(keyed.around(0.0), (0, 0, 0.0));
    assert_eq!(keyed.around(0.5), (0, 1, 0.0));
    assert_eq!(keyed.around(2.0), (1, 2, 0.5));
    // It begins anew where the last keyframe is.
    assert_eq!(keyed.around(3.0), (0, 0, 0.0));
    assert_eq!(keyed.around(5.0), (1, 2, 0.5));
    assert_eq!(keyed.around(f32::NAN), (0, 0, 0.0));
}
