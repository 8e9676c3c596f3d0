//! What one invocation of a pass computes: that which wrote a pixel that was clicked, or one by its number.

use super::{PanelContext, shown_ms};
use crate::probe_report::{ProbeReport, ProbeSection};
use crate::view::stage::ProbedPlace;
use crate::view::state::PanelState;
use egui::{CollapsingHeader, ComboBox, DragValue, Grid, RichText, ScrollArea, TextEdit, Ui};
use lightgraph::internals::diag::render;

const HOW: &str =
    "Ctrl+click (on a Mac ⌘+click) a pixel of the image, or of a resource, to see what its shader computes.";

/// Characters of a value that are shown at once: a matrix would take all of the room.
const MOST_SHOWN: usize = 64;

/// Which invocation, and which of its values.
pub fn choose(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let answer = seen.feed.told.probed.as_ref().and_then(|p| p.answer.as_ref().ok());
    let (mut step, mut at) = match (state.ask.as_ref().map(|a| &a.of), answer) {
        (Some(ProbedPlace::Invocation { step, at }), _) => (step.clone(), *at),
        (_, Some(answer)) => (answer.step.clone(), answer.at),
        (_, None) => ("choose a step".to_string(), [0; 3]),
    };
    let before = (step.clone(), at);
    let combo = ComboBox::from_id_salt("probe step").selected_text(&step).width(190.0).height(400.0);
    let combo = combo.show_ui(ui, |ui| {
        for known in subject.plan.steps.iter().filter(|s| s.action.shader().is_some()) {
            ui.selectable_value(&mut step, known.name.clone(), &known.name);
        }
    });
    state.mark("probe step", combo.response.rect);
    for (axis, n) in ["x", "y", "z"].into_iter().zip(&mut at) {
        let place = ui.add(DragValue::new(n).speed(0.2).prefix(format!("{axis} ")));
        state.mark(format!("probe {axis}"), place.rect);
    }
    if before != (step.clone(), at) {
        state.ask(&subject.path, ProbedPlace::Invocation { step, at });
    }
    let find = TextEdit::singleline(&mut state.ask_search).hint_text("find a value").desired_width(120.0);
    let find = ui.add(find);
    state.mark("probe find", find.rect);
    let Some(ask) = state.ask.clone() else { return };
    let again = ui.button("ask again").on_hover_text("in a further frame");
    state.mark("probe again", again.rect);
    if again.clicked() {
        state.ask(&ask.graph, ask.of);
    }
    if let Some(answer) = answer
        && ui.button("copy").on_hover_text("all of it, as text").clicked()
    {
        ui.ctx().copy_text(answer.to_string());
    }
}

pub fn show(ui: &mut Ui, state: &PanelState, seen: &PanelContext) {
    let Some(ask) = &state.ask else {
        ui.label(HOW);
        return;
    };
    let Some(probed) = seen.feed.told.probed.as_ref().filter(|p| p.ask == *ask) else {
        ui.label("asking …");
        return;
    };
    let search = state.ask_search.to_lowercase();
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| match &probed.answer {
        Err(faults) => drop(ui.colored_label(ui.visuals().error_fg_color, render(&faults.0))),
        Ok(answer) => {
            ui.label(format!("{}   answered in {}", answer.title(), shown_ms(probed.ms)));
            let last = answer.invocations.len().saturating_sub(1);
            for (i, sections) in answer.invocations.iter().enumerate() {
                if last == 0 {
                    invocation(ui, sections, &search);
                } else {
                    let number = answer.number(i);
                    let head = CollapsingHeader::new(format!("invocation {number} of {}", answer.count));
                    head.default_open(i == last).show(ui, |ui| invocation(ui, sections, &search));
                }
            }
            left_out(ui, answer);
        }
    });
}

/// The sections side by side.
fn invocation(ui: &mut Ui, sections: &[ProbeSection], search: &str) {
    ui.horizontal_top(|ui| {
        for ProbeSection { title, rows } in sections {
            let found = rows.iter().filter(|(name, _)| name.to_lowercase().contains(search));
            let found: Vec<&(String, String)> = found.collect();
            if found.is_empty() {
                continue;
            }
            ui.vertical(|ui| {
                ui.label(RichText::new(title).strong());
                Grid::new(ui.next_auto_id()).num_columns(2).spacing([8.0, 1.0]).show(ui, |ui| {
                    for (name, value) in found {
                        ui.label(RichText::new(name).monospace());
                        let short: String = value.chars().take(MOST_SHOWN).collect();
                        let cut = short.len() < value.len();
                        let short = if cut { format!("{short} …") } else { short };
                        let label = ui.label(RichText::new(short).monospace().weak());
                        if cut {
                            label.on_hover_text(value);
                        }
                        ui.end_row();
                    }
                });
            });
            ui.separator();
        }
    });
}

fn left_out(ui: &mut Ui, answer: &ProbeReport) {
    if answer.left_out > 0 {
        let text = format!("{} values found no room; `lightgraph probe --value NAME` chooses", answer.left_out);
        ui.label(RichText::new(text).weak());
    }
}
