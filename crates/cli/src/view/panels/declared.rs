//! The graph as it is declared: passes in the order of the text, each with what the plan made of it and whether that
//! ran. A click opens the file at the pass.

use super::{PanelContext, shown_ms};
use crate::view::editor;
use crate::view::feed::PassTimes;
use crate::view::state::PanelState;
use egui::{Align, Color32, Layout, RichText, ScrollArea, Sense, Ui};
use lightgraph::internals::graph::ast::Pass;

const RAN: Color32 = Color32::from_rgb(0x56, 0xb4, 0xe9);
const LEFT_OUT: Color32 = Color32::from_rgb(0xc0, 0x7a, 0x7a);

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let search = state.network.search.to_lowercase();
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        passes(ui, state, (&seen.feed.passes, &search), &subject.graph.passes);
    });
}

fn passes(ui: &mut Ui, state: &mut PanelState, (times, search): (&[PassTimes], &str), of: &[Pass]) {
    for pass in of {
        let bodies = pass.kind.bodies();
        let wanted = pass.name.value.to_lowercase().contains(search);
        row(ui, state, pass, (times, wanted));
        for (i, body) in bodies.iter().enumerate() {
            ui.indent((&pass.name.value, i), |ui| passes(ui, state, (times, search), body));
        }
    }
}

fn row(ui: &mut Ui, state: &mut PanelState, pass: &Pass, (times, wanted): (&[PassTimes], bool)) {
    let name = &pass.name.value;
    ui.allocate_ui_with_layout(egui::vec2(900.0, 16.0), Layout::left_to_right(Align::Center), |ui| {
        let text = RichText::new(name).monospace();
        let label = ui.label(if wanted { text.strong() } else { text.weak() });
        let label = label.interact(Sense::click());
        state.mark(format!("declared {name}"), label.rect);
        if label.clicked() {
            state.message = Some(match editor::open(&pass.name.span) {
                Ok(told) => (true, told),
                Err(why) => (false, why),
            });
        }
        ui.label(RichText::new(pass.kind.word()).small().weak());
        let Some(made) = times.iter().find(|p| p.name == *name) else { return };
        let steps = if made.steps == 1 { "1 step".to_string() } else { format!("{} steps", made.steps) };
        let (mut words, color) = match (made.ran, made.steps) {
            (_, 0) => ("left out".to_string(), LEFT_OUT),
            (0, _) => (format!("{steps}, skipped"), ui.visuals().weak_text_color()),
            (ran, _) => {
                let time = made.gpu_ms.unwrap_or(made.cpu_ms);
                (format!("{steps}, {ran} ran in {}", shown_ms(time)), RAN)
            }
        };
        if !made.why.is_empty() {
            words = format!("{words}: {}", made.why);
        }
        ui.label(RichText::new(words).small().color(color));
    });
}
