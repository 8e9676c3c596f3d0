//! Memory over the order of the steps: a row for each piece of it, in which a bar is the lifetime of a resource. Bars
//! in one row share memory.

use super::PanelContext;
use crate::view::state::PanelState;
use egui::{Align2, Color32, FontId, Pos2, Rect, RichText, ScrollArea, Sense, Stroke, StrokeKind, Ui, Vec2};
use lightgraph::Plan;
use lightgraph::internals::plan::{Resource, StepId, steps_of};

const ROW: f32 = 18.0;
/// Room of the names of pieces, and at least that of a step.
const LABEL: f32 = 150.0;
const LEAST: f32 = 6.0;

const SHARED: Color32 = Color32::from_rgb(0x35, 0xc7, 0x9d);
const ALONE: Color32 = Color32::from_rgb(0x56, 0xb4, 0xe9);
const LASTING: Color32 = Color32::from_rgb(0xe0, 0xb4, 0x3c);

pub fn summary(ui: &mut Ui, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let (shared, own) = subject.shared.bytes();
    let (slots, resources) = (subject.shared.slots.len(), subject.shared.resources.len());
    ui.label(format!("{} in {slots} pieces; {} for {resources} resources unshared", mib(shared), mib(own)));
    for (color, text) in [(ALONE, "memory of its own"), (SHARED, "shares it"), (LASTING, "stays from frame to frame")] {
        let (rect, _) = ui.allocate_exact_size(Vec2::splat(10.0), Sense::hover());
        ui.painter().rect_filled(rect, 2.0, color);
        ui.label(text);
    }
    ui.label(RichText::new("as `render` runs it; the window keeps all apart").weak());
}

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let plan = &subject.shared;
    let steps = steps_of(&plan.order);
    let count = steps.len().max(1);
    let mut slots: Vec<usize> = (0..plan.slots.len()).collect();
    slots.sort_by_key(|s| (std::cmp::Reverse(plan.slots[*s].bytes), *s));
    let mut open = None;
    ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        let width = (ui.available_width() - LABEL - 12.0).max(count as f32 * LEAST);
        let size = Vec2::new(LABEL + width, ROW * slots.len() as f32);
        let (area, response) = ui.allocate_exact_size(size, Sense::hover());
        state.mark("memory", area.intersect(ui.clip_rect()));
        let column = width / count as f32;
        if let Some(x) = response.hover_pos().map(|at| at.x - area.left() - LABEL).filter(|x| *x >= 0.0) {
            // Which step a place stands for.
            let at = (x / column) as usize;
            let middle = area.left() + LABEL + column * (at as f32 + 0.5);
            ui.painter().vline(middle, area.y_range(), Stroke::new(1.0, ui.visuals().weak_text_color()));
            if let Some(step) = steps.get(at) {
                response.on_hover_text_at_pointer(&plan.steps[step.0].name);
            }
        }
        for (row, slot) in slots.iter().enumerate() {
            let y = area.top() + ROW * row as f32;
            if row % 2 == 1 {
                let stripe = Rect::from_min_size(Pos2::new(area.left(), y), Vec2::new(area.width(), ROW));
                ui.painter().rect_filled(stripe, 0.0, ui.visuals().faint_bg_color);
            }
            let label = format!("{} · {slot}", mib(plan.slots[*slot].bytes));
            let at = Pos2::new(area.left() + LABEL - 8.0, y + ROW / 2.0);
            let color = ui.visuals().weak_text_color();
            ui.painter().text(at, Align2::RIGHT_CENTER, label, FontId::monospace(10.0), color);
            let tenants: Vec<&Resource> = plan.resources.iter().filter(|r| r.slot == *slot).collect();
            for resource in &tenants {
                let left = area.left() + LABEL + column * resource.lifetime.0.min(count) as f32;
                let right = area.left() + LABEL + column * (resource.lifetime.1 + 1).min(count) as f32;
                let corners = [Pos2::new(left, y + 2.0), Pos2::new(right.max(left + 3.0), y + ROW - 2.0)];
                let bar = Rect::from_min_max(corners[0], corners[1]);
                if let Some(name) = lifetime(ui, state, bar, resource, (plan, &steps), tenants.len() > 1) {
                    open = Some(name);
                }
            }
        }
    });
    if let Some(name) = open {
        state.open(&name);
    }
}

/// A bar; the resource's name where it was clicked.
fn lifetime(
    ui: &Ui,
    state: &mut PanelState,
    bar: Rect,
    resource: &Resource,
    (plan, steps): (&Plan, &[StepId]),
    shares: bool,
) -> Option<String> {
    let visible = bar.intersect(ui.clip_rect());
    if !visible.is_positive() {
        return None;
    }
    let color = match (resource.history, shares) {
        (true, _) => LASTING,
        (false, true) => SHARED,
        (false, false) => ALONE,
    };
    let response = ui.interact(visible, ui.scope_id().with(("lifetime", &resource.name)), Sense::click());
    let fill = color.gamma_multiply(if response.hovered() { 0.6 } else { 0.35 });
    ui.painter().rect(bar, 3.0, fill, Stroke::new(1.0, color), StrokeKind::Inside);
    let text = ui.visuals().strong_text_color();
    let at = Pos2::new(bar.left() + 4.0, bar.center().y);
    ui.painter().with_clip_rect(visible).text(at, Align2::LEFT_CENTER, &resource.name, FontId::monospace(10.0), text);
    state.mark(format!("lifetime {}", resource.name), visible);
    let step = |at: usize| steps.get(at).map_or("the end", |s| plan.steps[s.0].name.as_str());
    let (first, last) = resource.lifetime;
    let when = if resource.history {
        "from frame to frame".to_string()
    } else {
        format!("from `{}` to `{}`", step(first), step(last))
    };
    let clicked = response.clicked();
    response.on_hover_text(format!("{}: {}, {when}", resource.name, mib(resource.desc.bytes())));
    clicked.then(|| resource.name.clone())
}

fn mib(bytes: u64) -> String {
    match bytes {
        b if b < 10 << 10 => format!("{b} B"),
        b if b < 10 << 20 => format!("{} KiB", b >> 10),
        b => format!("{} MiB", b >> 20),
    }
}
