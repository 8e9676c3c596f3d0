//! Holds what a plan is made from, and the values that are known before a frame.

use super::fastest::Choices;
use crate::diag::{Checked, Diagnostic, Faults, Span};
use crate::graph::Graph;
use crate::graph::ast::{Raster, told_groups};
use crate::graph::expr::{Expr, Val};
use crate::scene::Level;
use crate::shader::Library;
use crate::value::{Value, Values};
use glam::UVec2;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Everything a plan depends on. Plain data: no device.
#[derive(Clone, Copy)]
pub struct Request<'a> {
    pub graph: &'a Graph,
    pub texts: &'a Library,
    /// Parameters that differ from their defaults.
    pub params: &'a Values,
    /// The scene's facts: all names of [`crate::scene::FACTS`].
    pub facts: &'a Values,
    /// Width and height of the image, in pixels.
    pub screen: [u32; 2],
    /// Outputs to produce; `None` for all.
    pub outputs: Option<&'a [String]>,
    /// Which alternatives run; see [`super::fastest::FIRST`].
    pub choices: &'a Choices,
    /// Parts of the scene that draws ask for, as [`super::draw::asked_parts`] lists them. A draw whose part is missing
    /// draws the scene as it is.
    pub levels: &'a [Arc<Level>],
    pub limits: &'a wgpu_types::Limits,
    pub features: wgpu_types::Features,
}

/// The tolerance of a draw; `None` for 0 or without one.
///
/// # Errors
/// It is no number of metres.
pub(super) fn tolerance(r: &Raster, values: &Values) -> Result<Option<f32>, Diagnostic> {
    let Some(expr) = &r.tolerance else { return Ok(None) };
    let metres = match expr.eval(&|n| values.get(n).map(|v| Val::from(*v)))? {
        Val::Int(i) => i as f32,
        Val::Float(f) => f as f32,
        _ => return Err(Diagnostic::error("expected a number of metres").at(&expr.span, "")),
    };
    if !(metres >= 0.0 && metres.is_finite()) {
        let d = Diagnostic::error(format!("a tolerance of {metres} metres")).at(&expr.span, "");
        return Err(d.help("0 draws every triangle, more draws fewer"));
    }
    Ok((metres > 0.0).then_some(metres))
}

/// Parameters, facts, `screen` and lets.
///
/// # Errors
/// Unknown parameters, values out of range, lets that can't be computed.
pub fn values(request: &Request) -> Checked<Values> {
    let graph = request.graph;
    let mut faults = vec![];
    let mut values = request.facts.clone();
    values.insert("screen".into(), Value::UVec2(UVec2::from(request.screen)));
    for (name, param) in &graph.params {
        let value = request.params.get(&name.value).unwrap_or(&param.default);
        if let Err(why) = param.accepts(value) {
            let d = Diagnostic::error(format!("parameter `{}` = {value} is {why}", name.value));
            faults.push(d.at(&param.span, "declared here"));
        }
        values.insert(name.value.clone(), *value);
    }
    for name in told_groups(&graph.passes) {
        let index = request.choices.get(&name.value).map_or(0, |c| c.index);
        values.insert(name.value.clone(), Value::Uint(index as u32));
    }
    for name in request.params.keys() {
        if !graph.params.iter().any(|(n, _)| n.value == *name) {
            let d = Diagnostic::error(format!("the graph has no parameter `{name}`"));
            faults.push(d.nearest(name, graph.params.iter().map(|(n, _)| n.value.as_str())));
        }
    }
    // A let may use those after it: go round until nothing more can be computed. Cycles were found by the check.
    let mut open: Vec<_> = graph.lets.iter().collect();
    while !open.is_empty() {
        let before = open.len();
        let mut errors: Vec<Diagnostic> = vec![];
        open.retain(|(name, e)| {
            let mut ready = true;
            e.names(&mut |n, _| ready &= values.contains_key(n));
            if !ready {
                return true;
            }
            match e.eval(&|n| values.get(n).map(|v| Val::from(*v))) {
                Ok(val) => match val.to_value() {
                    Some(v) => drop(values.insert(name.value.clone(), v)),
                    None => {
                        errors.push(Diagnostic::error(format!("`{}` doesn't fit 32 bits", name.value)).at(&e.span, ""))
                    }
                },
                Err(d) => errors.push(d),
            }
            false
        });
        faults.append(&mut errors);
        if open.len() == before {
            break;
        }
    }
    Faults::check(faults, values)
}

/// Evaluates to a count that fits `u32`.
pub fn count(e: &Expr, values: &Values, what: &str) -> Result<u32, Diagnostic> {
    count_with(e, &|n| values.get(n).map(|v| Val::from(*v)), what)
}

/// As [`count`], with names looked up by a function.
pub fn count_with(e: &Expr, name: &dyn Fn(&str) -> Option<Val>, what: &str) -> Result<u32, Diagnostic> {
    match e.eval(name)? {
        Val::Int(i) => u32::try_from(i).map_err(|_| absurd(&e.span, what, i)),
        Val::Bool(b) => Ok(b.into()),
        _ => Err(Diagnostic::error(format!("{what} must be an integer")).at(&e.span, "")),
    }
}

/// The fault of a size or count that is negative or beyond 32 bits.
pub fn absurd(span: &Span, what: &str, value: i64) -> Diagnostic {
    Diagnostic::error(format!("{what} is {value}")).at(span, "must lie between 0 and 4294967295")
}

/// What checks without a device hold a graph to: the limits and features of any recent Vulkan adapter.
pub fn sample_device() -> (wgpu_types::Limits, wgpu_types::Features) {
    let limits = wgpu_types::Limits { max_multiview_view_count: 6, ..wgpu_types::Limits::default() };
    use wgpu_types::Features as F;
    (limits, F::FLOAT32_FILTERABLE | F::MULTIVIEW | F::INDIRECT_FIRST_INSTANCE)
}

/// Typical facts for checks without a scene: everything a scene can have, or nothing of it. See [`all_sample_facts`].
pub fn sample_facts(full: bool) -> Values {
    let n = u32::from(full);
    let counts = crate::scene::FACTS.iter().filter_map(|(name, ty)| match ty {
        crate::value::Type::Uint => Some(((*name).to_string(), Value::Uint(n))),
        crate::value::Type::Float => Some(((*name).to_string(), Value::Float(n as f32))),
        _ => None,
    });
    let mut facts: BTreeMap<_, _> = counts.collect();
    // A light of each kind.
    facts.insert("lights".into(), Value::Uint(3 * n));
    facts.insert("light_views".into(), Value::Uint(8 * n));
    for name in ["bounds_min", "grid_min"] {
        facts.insert(name.into(), Value::Vec3(glam::Vec3::NEG_ONE));
    }
    for name in ["bounds_max", "grid_max"] {
        facts.insert(name.into(), Value::Vec3(glam::Vec3::ONE));
    }
    facts
}

/// The facts of scenes that together take every way through a graph: one that has everything, one without holes in its
/// surfaces and one with points and spots for its only lights, for which some passes have a quicker way, and one that
/// has nothing.
pub fn all_sample_facts() -> Vec<Values> {
    let without = |names: &[&str]| {
        let mut facts = sample_facts(true);
        facts.extend(names.iter().map(|name| ((*name).to_string(), Value::Uint(0))));
        facts
    };
    let emissive = ["emitters", "emissive_materials", "emission_textures"];
    let mut lamps = without(&[&["masked_materials", "environment", "directional_lights"], &emissive[..]].concat());
    lamps.extend([("lights".into(), Value::Uint(2)), ("light_views".into(), Value::Uint(7))]);
    vec![sample_facts(true), without(&["masked_materials"]), lamps, sample_facts(false)]
}
