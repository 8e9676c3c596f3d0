//! A plan as a picture, before anybody draws it: boxes with names, frames and wires, each with its place.

use super::layout::{BoxExtent, NetworkLayout, layout};
pub use super::layout::{Rect, WireLine};
use super::network::{Network, NetworkPass, network};
use lightgraph::internals::plan::{Plan, ResourceId, StepId};
use std::collections::BTreeSet;

/// Widths of a character of a monospaced font, in px: 0.6 of its size.
const TITLE: f32 = 7.8;
const SMALL: f32 = 6.6;
/// Height of a port.
const PORT: f32 = 18.0;

/// Passes as boxes in rows by depth with what they write at their feet, a wire from each to its readers, loops as
/// frames. Lengths are in px; names of passes take letters of 13 px, all others of 11 px, of a monospaced font.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: f32,
    pub height: f32,
    pub boxes: Vec<PassBox>,
    /// Title and frame; outer loops first.
    pub loops: Vec<(String, Rect)>,
    pub wires: Vec<WireLine>,
}

/// A pass, a step of one (in a small plan), or an output.
#[derive(Debug, Clone, PartialEq)]
pub struct PassBox {
    pub name: String,
    /// The word for its kind in lower case; "output" for an output.
    pub kind: &'static str,
    /// Kind, shader, how many steps.
    pub about: String,
    /// What it reads that an earlier iteration or frame wrote, behind a `↻`; empty without any.
    pub carried: String,
    pub rect: Rect,
    pub steps: Vec<StepId>,
    pub ports: Vec<PortBox>,
}

/// What a pass writes.
#[derive(Debug, Clone, PartialEq)]
pub struct PortBox {
    /// As wires name it.
    pub port: usize,
    pub resource: String,
    /// One, or the members of a set that is drawn as one.
    pub ids: Vec<ResourceId>,
    pub rect: Rect,
}

/// Draws a plan in the mind. Small plans are seen step by step, large ones pass by pass.
/// Each of the `collapsed` sub-graphs is one box.
pub fn picture(plan: &Plan, collapsed: &BTreeSet<String>) -> Picture {
    let net = network(plan, collapsed);
    let extents: Vec<BoxExtent> = net.passes.iter().map(|p| extent(&net, p)).collect();
    let NetworkLayout { width, height, passes, loops, wires, .. } = layout(&net, &extents);
    let boxes = passes.into_iter().filter_map(|(i, rect)| {
        let (pass, extent) = (net.passes.get(i)?, extents.get(i)?);
        let ports = extent.ports.iter().filter_map(|(port, x)| {
            let known = net.ports.get(*port)?;
            let width = port_width(&known.resource);
            let rect = Rect { x: rect.x + x - width / 2.0, y: rect.y + rect.height - PORT, width, height: PORT };
            Some(PortBox { port: *port, resource: known.resource.clone(), ids: known.ids.clone(), rect })
        });
        Some(PassBox {
            name: pass.name.clone(),
            kind: pass.kind,
            about: about(pass),
            carried: carried(pass),
            rect,
            steps: pass.steps.clone(),
            ports: ports.collect(),
        })
    });
    Picture { width, height, boxes: boxes.collect(), loops, wires }
}

/// The room of a pass: its name, its kind and shader, what it reads from before, and its ports in a row.
pub(super) fn extent(net: &Network, pass: &NetworkPass) -> BoxExtent {
    let chars = |text: &str| text.chars().count() as f32;
    let words = (chars(&pass.name) * TITLE).max(chars(&about(pass)) * SMALL).max(chars(&carried(pass)) * SMALL);
    let mut ports = vec![];
    let mut x = 10.0;
    for port in &pass.ports {
        let width = port_width(&net.ports[*port].resource);
        ports.push((*port, x + width / 2.0));
        x += width + 6.0;
    }
    let width = (words + 20.0).max(x + 4.0);
    // The row of ports sits in the middle.
    let shift = if ports.is_empty() { 0.0 } else { (width - x + 6.0 - 10.0) / 2.0 };
    ports.iter_mut().for_each(|p| p.1 += shift);
    let lines = if pass.carried.is_empty() { 0.0 } else { 15.0 };
    let foot = if pass.ports.is_empty() { 0.0 } else { PORT + 4.0 };
    BoxExtent { width, height: 42.0 + lines + foot, ports }
}

fn port_width(resource: &str) -> f32 {
    resource.chars().count() as f32 * SMALL + 14.0
}

fn about(pass: &NetworkPass) -> String {
    let times = if pass.steps.len() > 1 { format!(" × {}", pass.steps.len()) } else { String::new() };
    if pass.shader.is_empty() {
        format!("{}{times}", pass.kind)
    } else {
        format!("{} {}{times}", pass.kind, pass.shader)
    }
}

fn carried(pass: &NetworkPass) -> String {
    if pass.carried.is_empty() { String::new() } else { format!("↻ {}", pass.carried.join(", ")) }
}
