//! Numbers of a case: as they stand, or computed from what the case varies.

use glam::DVec3;
use lightgraph::internals::diag::{Source, Span};
use lightgraph::internals::graph::expr::{Expr, Val};
use lightgraph::{Checked, Diagnostic};
use std::collections::BTreeMap;

/// What a case varies, and further names for its formulas.
pub(super) type CaseNames = BTreeMap<String, String>;

/// A number, or a formula over names.
#[derive(Debug, Clone, PartialEq, serde::Deserialize)]
#[serde(untagged)]
pub(super) enum Formula {
    Value(f64),
    Formula(String),
}

impl Default for Formula {
    fn default() -> Formula {
        Formula::Value(0.0)
    }
}

impl Formula {
    /// The value.
    ///
    /// # Errors
    /// A formula that is none, or uses a name that nothing gives.
    pub fn value(&self, names: &CaseNames) -> Checked<f64> {
        match self {
            Formula::Value(v) => Ok(*v),
            Formula::Formula(text) => formula(text, names),
        }
    }
}

/// Three of them.
///
/// # Errors
/// As [`Number::value`].
pub(super) fn vector(v: &(Formula, Formula, Formula), names: &CaseNames) -> Checked<DVec3> {
    Ok(DVec3::new(v.0.value(names)?, v.1.value(names)?, v.2.value(names)?))
}

/// The value of a formula in the language of graphs' expressions; whole numbers count as real ones, so that `/`
/// divides.
///
/// # Errors
/// As [`Number::value`].
pub(super) fn formula(text: &str, names: &CaseNames) -> Checked<f64> {
    let source = Source::new("formula", text);
    let e = Expr::parse(&Span::whole(&source), text)?;
    let val = e.eval(&|name| match name {
        "pi" => Some(Val::Float(std::f64::consts::PI)),
        _ => names.get(name).and_then(|v| v.parse().ok()).map(Val::Float),
    })?;
    match val {
        Val::Float(v) => Ok(v),
        Val::Int(v) => Ok(v as f64),
        _ => Err(Diagnostic::error(format!("`{text}` is no number")).into()),
    }
}
