//! The graphs to choose from, each with the last image that it gave.

use super::PanelContext;
use crate::view::state::PanelState;
use egui::{Color32, Image, Rect, RichText, ScrollArea, Sense, Vec2};
use std::path::PathBuf;

/// The room of a preview, in points.
const PREVIEW: Vec2 = Vec2::new(44.0, 28.0);
/// The list's height at most, in points; longer ones scroll.
const HEIGHT: f32 = 250.0;

pub fn show(ui: &mut egui::Ui, state: &mut PanelState, seen: &PanelContext) {
    let told = &seen.feed.told;
    if let Some(subject) = &told.subject {
        ui.label(RichText::new(&subject.graph.about).weak());
        let mut shown = state.output.clone();
        let outputs: Vec<&str> = subject.plan.outputs.iter().map(|o| o.0.as_str()).collect();
        if outputs.len() > 1 {
            ui.horizontal_wrapped(|ui| {
                let usual = if outputs.contains(&"color") { "color" } else { outputs[0] };
                for output in &outputs {
                    let chosen = shown.as_deref().filter(|o| outputs.contains(o)).unwrap_or(usual) == *output;
                    let button = ui.selectable_label(chosen, *output);
                    if button.clicked() {
                        shown = Some((*output).to_string());
                    }
                    state.mark(format!("output {output}"), button.rect);
                }
            });
        }
        state.output = shown;
    }
    ui.add_space(4.0);
    let mut chosen = None;
    ScrollArea::vertical().id_salt("variants").max_height(HEIGHT).auto_shrink([false, true]).show(ui, |ui| {
        chosen = list(ui, state, seen);
    });
    if let Some(path) = chosen {
        state.set_graph(path);
    }
    let text = "Renders each graph once in the background, so that switching to it is instant";
    let prepare = ui.checkbox(&mut state.prepare, "prepare all").on_hover_text(text);
    state.mark("prepare all", prepare.rect);
}

/// The graphs; the one that is clicked.
fn list(ui: &mut egui::Ui, state: &mut PanelState, seen: &PanelContext) -> Option<PathBuf> {
    let mut chosen = None;
    for variant in seen.feed.told.variants.iter() {
        let current = variant.path.file_name() == state.now().graph.file_name();
        let row = ui.horizontal(|ui| {
            let (room, _) = ui.allocate_exact_size(PREVIEW, Sense::hover());
            ui.painter().rect_filled(room, 2.0, ui.visuals().extreme_bg_color);
            if let Some(preview) = seen.previews.get(&variant.path) {
                let [w, h] = preview.size.map(|n| n as f32);
                let size = Vec2::new(w, h) * (room.width() / w).min(room.height() / h);
                Image::new((preview.id, size)).paint_at(ui, Rect::from_center_size(room.center(), size));
            }
            let color = if variant.broken { Color32::from_rgb(0xe5, 0x48, 0x4d) } else { ui.visuals().text_color() };
            ui.selectable_label(current, RichText::new(&variant.name).color(color)).on_hover_text(&variant.about)
        });
        if row.inner.clicked() {
            chosen = Some(variant.path.clone());
        }
        if ui.clip_rect().contains_rect(row.inner.rect) {
            state.mark(format!("variant {}", variant.name), row.inner.rect);
        }
    }
    chosen
}
