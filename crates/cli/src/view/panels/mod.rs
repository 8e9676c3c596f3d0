//! The parts of the window: above a bar, on the left what is rendered, on the right how it is shown and compared, below
//! what it takes and what it is made of, and the image in the middle.

mod bar;
mod compare;
mod declared;
mod image;
mod memory;
mod network;
mod parameters;
mod probe;
mod resource;
mod steps;
mod subject;
mod variants;

use super::canvas::ShownTexture;
use super::feed::Feed;
use super::overlay;
use super::state::{PanelState, Tab};
use egui::{CentralPanel, Color32, Frame, Panel, RichText, ScrollArea};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What can be shown at this moment.
pub struct PanelContext<'a> {
    pub feed: &'a Feed,
    pub image: Option<ShownTexture>,
    pub previews: &'a BTreeMap<PathBuf, ShownTexture>,
    pub scenes: &'a [PathBuf],
    /// Seconds, for scenes that move.
    pub time: f32,
    pub adapter: &'a str,
    /// What another program is given to show its scene.
    pub link: Option<&'a str>,
}

/// Shows the window's parts, and lets them change the state.
pub fn show(ui: &mut egui::Ui, state: &mut PanelState, seen: &PanelContext) {
    bar::keys(ui, state);
    Panel::top("bar").show(ui, |ui| bar::show(ui, state, seen));
    if state.panels.bottom {
        let panel = Panel::bottom("bottom").resizable(true).default_size(230.0).min_size(90.0);
        let rect = panel.show(ui, |ui| bottom(ui, state, seen)).response.rect;
        state.mark("bottom edge", egui::Rect::from_x_y_ranges(rect.x_range(), rect.top()..=rect.top() + 2.0));
    }
    if state.panels.left {
        Panel::left("left").resizable(true).default_size(300.0).min_size(180.0).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                heading(ui, "Graph");
                variants::show(ui, state, seen);
                heading(ui, "Parameters");
                parameters::show(ui, state, seen);
            });
        });
    }
    if state.panels.right {
        Panel::right("right").resizable(true).default_size(270.0).min_size(180.0).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                heading(ui, "Scene");
                subject::scene(ui, state, seen);
                heading(ui, "Image");
                subject::image(ui, state, seen);
                heading(ui, "Compare");
                compare::show(ui, state, seen);
                heading(ui, "Save");
                subject::save(ui, state);
            });
        });
    }
    let frame = Frame::default().fill(Color32::from_gray(18));
    let rect = CentralPanel::default().frame(frame).show(ui, |ui| image::show(ui, state, seen)).inner;
    overlay::show(ui, state, &seen.feed.told, rect);
    if ui.input(|i| i.pointer.any_released()) {
        state.choice.rest();
    }
}

fn bottom(ui: &mut egui::Ui, state: &mut PanelState, seen: &PanelContext) {
    // The panel is as high as the user made it, whatever is in it.
    ui.set_min_size(ui.available_size());
    ui.horizontal(|ui| {
        for (tab, label) in [
            (Tab::Steps, "Passes"),
            (Tab::Graph, "Graph"),
            (Tab::Memory, "Memory"),
            (Tab::Resource, "Resource"),
            (Tab::Probe, "Probe"),
        ] {
            let button = ui.selectable_value(&mut state.panels.tab, tab, label);
            state.mark(format!("tab {label}"), button.rect);
        }
        ui.separator();
        match state.panels.tab {
            Tab::Steps => steps::summary(ui, seen),
            Tab::Graph => network::summary(ui, state, seen),
            Tab::Memory => memory::summary(ui, seen),
            Tab::Resource => resource::choose(ui, state, seen),
            Tab::Probe => probe::choose(ui, state, seen),
        }
    });
    ui.separator();
    match state.panels.tab {
        Tab::Steps => steps::show(ui, state, seen),
        Tab::Graph if state.network.declared => declared::show(ui, state, seen),
        Tab::Graph => network::show(ui, state, seen),
        Tab::Memory => memory::show(ui, state, seen),
        Tab::Resource => resource::show(ui, state, seen),
        Tab::Probe => probe::show(ui, state, seen),
    }
}

fn heading(ui: &mut egui::Ui, text: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(text).strong().size(14.0));
    ui.separator();
}

/// Milliseconds, in few digits.
fn shown_ms(ms: f64) -> String {
    match ms {
        ms if ms < 10.0 => format!("{ms:.2} ms"),
        ms if ms < 100.0 => format!("{ms:.1} ms"),
        ms => format!("{ms:.0} ms"),
    }
}

/// The name of a file without its folder and ending.
fn stem(path: &std::path::Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
