//! The image held against another graph or a file: which, how, and how far it is from it.

use super::{PanelContext, stem};
use crate::view::choice::{ComparedTo, SplitLayout};
use crate::view::feed::ShownScore;
use crate::view::state::PanelState;
use egui::{ComboBox, Grid, RichText, Slider, Ui};
use std::path::PathBuf;

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let now = state.now().compare.clone();
    let shown = match &now.against {
        ComparedTo::Nothing => "nothing".to_string(),
        ComparedTo::Graph(path) => format!("graph {}", stem(path)),
        ComparedTo::Image(path) => format!("file {}", stem(path)),
    };
    let mut next = now.clone();
    let combo = ComboBox::from_id_salt("against").selected_text(shown).width(200.0).height(360.0).show_ui(ui, |ui| {
        ui.selectable_value(&mut next.against, ComparedTo::Nothing, "nothing");
        for variant in seen.feed.told.variants.iter().filter(|v| !v.broken) {
            if variant.path.file_name() != state.now().graph.file_name() {
                let against = ComparedTo::Graph(variant.path.clone());
                let row = ui.selectable_value(&mut next.against, against, &variant.name);
                state.mark(format!("against {}", variant.name), row.rect);
                row.on_hover_text(&variant.about);
            }
        }
    });
    state.mark("against", combo.response.rect);
    ui.horizontal(|ui| {
        let field =
            egui::TextEdit::singleline(&mut state.file).hint_text("FILE.exr, or drop one here").desired_width(170.0);
        let entered = ui.add(field).lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        if (entered || ui.button("open").clicked()) && !state.file.trim().is_empty() {
            next.against = ComparedTo::Image(PathBuf::from(state.file.trim()));
        }
    });
    if next.against != ComparedTo::Nothing {
        layout(ui, state, &mut next.layout);
    }
    if next != now {
        state.edit(if next.against == now.against { "layout" } else { "against" }, |c| c.compare = next);
    }
    if now.against != ComparedTo::Nothing {
        score(ui, state, seen);
    }
}

fn layout(ui: &mut Ui, state: &mut PanelState, layout: &mut SplitLayout) {
    ui.horizontal(|ui| {
        let kinds = [
            ("split", SplitLayout::Split(0.5), matches!(layout, SplitLayout::Split(_))),
            ("difference", SplitLayout::Difference(0.1), matches!(layout, SplitLayout::Difference(_))),
            ("other", SplitLayout::Other, matches!(layout, SplitLayout::Other)),
        ];
        for (label, kind, chosen) in kinds {
            let button = ui.selectable_label(chosen, label);
            if button.clicked() && !chosen {
                *layout = kind;
            }
            state.mark(format!("layout {label}"), button.rect);
        }
    });
    match layout {
        SplitLayout::Split(at) => {
            let slider = ui.add(Slider::new(at, 0.0..=1.0).text("at").show_value(false));
            state.mark("split", slider.rect);
        }
        SplitLayout::Difference(full) => {
            ui.add(Slider::new(full, 1e-4..=10.0).logarithmic(true).text("full colour"));
            ui.label(RichText::new("red: brighter than the other; blue: darker; white: equal").small().weak());
        }
        SplitLayout::Other => {}
    }
}

fn score(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let told = &seen.feed.told;
    if told.frames[1] > 1 && !told.rest {
        ui.label(RichText::new(format!("the other is at frame {}", told.frames[1])).weak());
    }
    match told.score.as_deref() {
        None => drop(ui.label("…")),
        Some(ShownScore::Fault(why)) => drop(ui.colored_label(ui.visuals().warn_fg_color, why)),
        Some(ShownScore::Metrics(m)) => {
            let rows = [
                ("RMSE", format!("{:.2} %", m.rmse_percent), "root mean square error, relative to the other's mean"),
                ("bias", format!("{:+.2} %", m.bias_percent), "of the mean; too dark is negative"),
                ("relMSE", format!("{:.5}", m.relmse), "mean of squared errors over squared light (+ 0.01)"),
                ("8 × 8 RMSE", format!("{:.2} %", m.block_rmse_percent), "of means over blocks: noise averages out"),
                ("95 %", format!("{:.4}", m.p95_error), "95 % of the values are no further away, in radiance"),
                ("largest", format!("{:.4}", m.max_error), "the largest error, in radiance"),
            ];
            let grid = Grid::new("score").num_columns(2).striped(true).show(ui, |ui| {
                for (name, value, about) in rows {
                    ui.label(name).on_hover_text(about);
                    ui.label(RichText::new(value).monospace());
                    ui.end_row();
                }
            });
            state.mark("score", grid.response.rect);
        }
    }
}
