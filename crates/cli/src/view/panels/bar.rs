//! The bar above all: panels, undo, time, what the last frame took.

use super::{PanelContext, shown_ms};
use crate::view::state::PanelState;
use egui::{Key, Modifiers, RichText};

/// Keys that hold everywhere but in text fields.
pub fn keys(ui: &egui::Ui, state: &mut PanelState) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let pressed = |modifiers, key| ui.input_mut(|i| i.consume_key(modifiers, key));
    let redo = pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y);
    if redo {
        state.choice.redo();
    } else if pressed(Modifiers::COMMAND, Key::Z) {
        state.choice.undo();
    }
    if pressed(Modifiers::NONE, Key::Tab) {
        let p = &mut state.panels;
        let open = p.left || p.right || p.bottom;
        (p.left, p.right, p.bottom) = (!open, !open, !open);
    }
    if pressed(Modifiers::NONE, Key::Space) {
        state.playing = !state.playing;
    }
    if pressed(Modifiers::NONE, Key::Escape) {
        state.selected = None;
    }
    if pressed(Modifiers::NONE, Key::Home) {
        state.edit("view", |c| c.view = None);
        state.choice.rest();
        state.pivot = None;
    }
}

pub fn show(ui: &mut egui::Ui, state: &mut PanelState, seen: &PanelContext) {
    ui.horizontal(|ui| {
        let panels = &mut state.panels;
        let toggles = [
            ("Graph", &mut panels.left, "the panel on the left"),
            ("View", &mut panels.right, "the panel on the right"),
            ("Passes", &mut panels.bottom, "the panel below"),
        ];
        let mut rects = vec![];
        for (label, open, about) in toggles {
            let button = ui.selectable_label(*open, label).on_hover_text(format!("{about}; Tab hides all"));
            if button.clicked() {
                *open = !*open;
            }
            rects.push((label, button.rect));
        }
        rects.into_iter().for_each(|(label, rect)| state.mark(format!("panel {label}"), rect));
        ui.separator();
        let undo = ui.add_enabled(state.choice.can_undo(), egui::Button::new("Undo")).on_hover_text("Ctrl+Z");
        if undo.clicked() {
            state.choice.undo();
        }
        let redo = ui.add_enabled(state.choice.can_redo(), egui::Button::new("Redo")).on_hover_text("Ctrl+Shift+Z");
        if redo.clicked() {
            state.choice.redo();
        }
        state.mark("undo", undo.rect);
        state.mark("redo", redo.rect);
        ui.separator();
        let moves = seen.feed.told.subject.as_ref().is_some_and(|s| s.moves);
        let label = if state.playing { "Pause" } else { "Play" };
        let play =
            ui.add_enabled(moves, egui::Button::new(label)).on_hover_text("Space; for scenes and shaders that move");
        if play.clicked() {
            state.playing = !state.playing;
        }
        state.mark("play", play.rect);
        ui.separator();
        status(ui, seen);
        if let Some((good, text)) = &state.message {
            ui.separator();
            let color = if *good { ui.visuals().text_color() } else { ui.visuals().error_fg_color };
            ui.label(RichText::new(text).color(color));
        }
    });
}

/// The adapter, the last frame, the last reload.
fn status(ui: &mut egui::Ui, seen: &PanelContext) {
    let told = &seen.feed.told;
    ui.label(seen.adapter);
    if let Some([gpu, wall]) = seen.feed.frames.back() {
        let words = format!("frame {}", shown_ms(*wall));
        ui.label(words).on_hover_text(format!("the last in which a pass ran; {} on the device", shown_ms(*gpu)));
    }
    if let Some(r) = told.remade {
        let stages =
            [("graph", r.graph_ms), ("scene", r.scene_ms), ("plan and pipelines", r.prepare_ms), ("frame", r.frame_ms)];
        let stages: Vec<String> = stages.iter().map(|(name, ms)| format!("{name} {}", shown_ms(*ms))).collect();
        let words = format!("last change made in {}", shown_ms(r.total_ms()));
        ui.label(words).on_hover_text(stages.join("\n"));
    }
    if !told.rest {
        ui.spinner();
    }
}
