//! What each pass takes, as bars with history; which ran, and why.

use super::{PanelContext, shown_ms};
use crate::view::feed::{HISTORY, PassTimes};
use crate::view::state::PanelState;
use egui::{Color32, Grid, Pos2, Rect, RichText, ScrollArea, Sense, Stroke, Ui, Vec2};
use std::collections::VecDeque;

const DEVICE: Color32 = Color32::from_rgb(0x56, 0xb4, 0xe9);
const HOST: Color32 = Color32::from_rgb(0xe0, 0xb4, 0x3c);
const BAR: Vec2 = Vec2::new(150.0, 12.0);
const LINE: Vec2 = Vec2::new(120.0, 16.0);

/// Whole frames, and steps that ran.
pub fn summary(ui: &mut Ui, seen: &PanelContext) {
    let passes = &seen.feed.passes;
    let (ran, steps) = passes.iter().fold((0, 0), |(r, s), p| (r + p.ran, s + p.steps));
    let frames: VecDeque<f32> = seen.feed.frames.iter().map(|f| f[1] as f32).collect();
    history(ui, &frames, DEVICE);
    ui.label(format!("last frame: {ran} of {steps} steps ran"));
    if let Some(subject) = &seen.feed.told.subject {
        let (bytes, _) = subject.plan.bytes();
        ui.label(format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)));
    }
    let square = |ui: &mut Ui, color, text: &str| {
        let (rect, _) = ui.allocate_exact_size(Vec2::splat(10.0), Sense::hover());
        ui.painter().rect_filled(rect, 2.0, color);
        ui.label(text);
    };
    square(ui, DEVICE, "device");
    square(ui, HOST, "host");
}

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let passes = &seen.feed.passes;
    let most = passes.iter().map(|p| p.gpu_ms.unwrap_or(0.0).max(p.cpu_ms)).fold(1e-6, f64::max);
    let untimed = passes.iter().any(|p| p.ran > 0) && passes.iter().all(|p| p.gpu_ms.is_none());
    if untimed {
        ui.label("This adapter has no timestamps: bars show the time that the host takes to record passes.");
    }
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        let grid = Grid::new("passes").striped(true).num_columns(6).spacing([10.0, 3.0]);
        let shown = grid.show(ui, |ui| {
            for pass in passes {
                row(ui, pass, most);
                ui.end_row();
            }
        });
        state.mark("passes", shown.response.rect);
    });
}

fn row(ui: &mut Ui, pass: &PassTimes, most: f64) {
    let name = RichText::new(&pass.name).monospace();
    let label = ui.label(if pass.ran == 0 { name.weak() } else { name });
    if let Some(group) = &pass.group {
        label.on_hover_text(format!("group {group}"));
    }
    bars(ui, pass, most);
    let words = match pass.gpu_ms {
        Some(gpu) => format!("{} · {}", shown_ms(gpu), shown_ms(pass.cpu_ms)),
        None if pass.cpu_ms > 0.0 => format!("– · {}", shown_ms(pass.cpu_ms)),
        None => String::new(),
    };
    ui.label(RichText::new(words).small().weak());
    history(ui, &pass.history, if pass.gpu_ms.is_some() { DEVICE } else { HOST });
    let state = match (pass.ran, pass.steps) {
        (_, 0) => "left out".to_string(),
        (0, 1) => "skipped".to_string(),
        (0, n) => format!("skipped × {n}"),
        (1, 1) => "ran".to_string(),
        (ran, n) => format!("ran {ran} of {n}"),
    };
    ui.label(if pass.ran > 0 { RichText::new(state).color(DEVICE) } else { RichText::new(state).weak() });
    ui.label(RichText::new(&pass.why).weak());
}

fn bars(ui: &mut Ui, pass: &PassTimes, most: f64) {
    let (rect, _) = ui.allocate_exact_size(BAR, Sense::hover());
    let bright = if pass.ran > 0 { 1.0 } else { 0.35 };
    let half = rect.height() / 2.0;
    let bar = |y: f32, ms: f64, color: Color32| {
        let width = (ms / most) as f32 * rect.width();
        let bar = Rect::from_min_size(rect.min + Vec2::new(0.0, y), Vec2::new(width.max(1.0), half - 0.5));
        ui.painter().rect_filled(bar, 1.0, color.gamma_multiply(bright));
    };
    if let Some(gpu) = pass.gpu_ms {
        bar(0.0, gpu, DEVICE);
    }
    if pass.cpu_ms > 0.0 {
        bar(half, pass.cpu_ms, HOST);
    }
}

/// A line of the last frames, its own largest value at the top.
fn history(ui: &mut Ui, values: &VecDeque<f32>, color: Color32) {
    let (rect, response) = ui.allocate_exact_size(LINE, Sense::hover());
    ui.painter().rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    let most = values.iter().copied().fold(0.0, f32::max);
    let step = rect.width() / HISTORY as f32;
    let start = rect.right() - step * values.len() as f32;
    for (i, value) in values.iter().enumerate().filter(|(_, v)| **v > 0.0) {
        let x = start + step * (i as f32 + 0.5);
        let y = rect.bottom() - (value / most) * (rect.height() - 1.0);
        let stroke = Stroke::new(step.max(1.0), color);
        ui.painter().line_segment([Pos2::new(x, rect.bottom()), Pos2::new(x, y)], stroke);
    }
    response.on_hover_text(format!("the last {} frames; at most {}", values.len(), shown_ms(f64::from(most))));
}
