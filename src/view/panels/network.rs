//! The compiled graph as a picture: passes as boxes, wires from what writes to what reads. A click on a resource shows it.

use super::Seen;
use crate::plan::change::Why;
use crate::plan::show::{PassBox, Picture, Wire};
use crate::view::feed::{Rendered, Subject};
use crate::view::state::State;
use egui::epaint::CubicBezierShape;
use egui::{Align2, Color32, FontId, Pos2, Rect, RichText, Scene, Sense, Shape, Stroke, StrokeKind, Ui, Vec2};

/// Colours of wires by turns, after Okabe and Ito's palette.
const COLORS: [Color32; 7] = [
    Color32::from_rgb(0x56, 0xb4, 0xe9),
    Color32::from_rgb(0xf0, 0x88, 0x4a),
    Color32::from_rgb(0x35, 0xc7, 0x9d),
    Color32::from_rgb(0xd9, 0x8b, 0xbb),
    Color32::from_rgb(0xe0, 0xb4, 0x3c),
    Color32::from_rgb(0x9b, 0x9f, 0xf0),
    Color32::from_rgb(0xa3, 0xab, 0xb8),
];
const TEXT: Color32 = Color32::from_rgb(0xe4, 0xe7, 0xeb);
const FAINT: Color32 = Color32::from_rgb(0x9a, 0xa5, 0xb1);

pub fn summary(ui: &mut Ui, state: &mut State, seen: &Seen) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let plan = &subject.plan;
    let words = format!(
        "{} passes, {} steps, {} resources",
        subject.picture.boxes.len(),
        plan.steps.len(),
        plan.resources.len()
    );
    ui.label(words);
    let fit = ui.button("fit").on_hover_text("the whole graph; drag to move, scroll to zoom");
    if fit.clicked() {
        state.network = Rect::NOTHING;
    }
    ui.label(RichText::new("drag to move, Ctrl+scroll to zoom, click a resource to see it").weak());
}

pub fn show(ui: &mut Ui, state: &mut State, seen: &Seen) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let picture = &subject.picture;
    let whole = Rect::from_min_size(Pos2::ZERO, Vec2::new(picture.width, picture.height)).expand(12.0);
    let mut view = if state.network.is_positive() { state.network } else { whole };
    let frame = seen.feed.told.frame.as_deref();
    let mut clicked = None;
    let mut marks = vec![];
    let scene = Scene::new().zoom_range(0.05..=2.0).show(ui, &mut view, |ui| {
        ui.allocate_rect(whole, Sense::hover());
        clicked = draw(ui, picture, subject, frame, &mut marks);
    });
    let to_screen = egui::emath::RectTransform::from_to(view, scene.response.rect);
    for (name, rect) in marks {
        state.mark(name, to_screen.transform_rect(rect));
    }
    state.network = view;
    if let Some(resource) = clicked {
        state.open(&resource);
    }
}

fn draw(
    ui: &mut Ui,
    picture: &Picture,
    subject: &Subject,
    frame: Option<&Rendered>,
    marks: &mut Vec<(String, Rect)>,
) -> Option<String> {
    for (_, rect) in &picture.loops {
        ui.painter().rect(place(*rect), 10.0, Color32::from_white_alpha(8), (1.0, FAINT), StrokeKind::Inside);
    }
    for w in &picture.wires {
        wire(ui, w);
    }
    for (title, rect) in &picture.loops {
        let at = Pos2::new(rect.x + 12.0, rect.y + 12.0);
        text(ui, at, Align2::LEFT_CENTER, &format!("loop {title}"), 13.0, TEXT);
    }
    let mut clicked = None;
    for pass in &picture.boxes {
        pass_box(ui, pass, frame);
        for port in &pass.ports {
            let rect = place(port.rect);
            let response = ui.allocate_rect(rect, Sense::click());
            let color = COLORS[port.port % COLORS.len()];
            let fill = if response.hovered() { color.gamma_multiply(0.4) } else { Color32::from_gray(24) };
            ui.painter().rect(rect, 4.0, fill, (1.6, color), StrokeKind::Inside);
            text(ui, rect.center(), Align2::CENTER_CENTER, &port.resource, 11.0, TEXT);
            let name = port.ids.first().and_then(|id| subject.plan.resources.get(id.0)).map(|r| r.name.clone());
            if response.clicked() {
                clicked.clone_from(&name);
            }
            marks.push((format!("port {}", port.resource), rect));
        }
    }
    clicked
}

fn pass_box(ui: &mut Ui, pass: &PassBox, frame: Option<&Rendered>) {
    let rect = place(pass.rect);
    let (fill, corner) = match pass.kind {
        "draw" | "screen" => (Color32::from_rgb(0x1c, 0x2b, 0x3d), 6.0),
        "compute" => (Color32::from_rgb(0x1a, 0x30, 0x28), 6.0),
        "output" => (Color32::from_rgb(0x3a, 0x30, 0x18), pass.rect.height / 2.0),
        _ => (Color32::from_rgb(0x26, 0x2b, 0x31), 6.0),
    };
    let why: Vec<&Why> = frame.iter().flat_map(|f| pass.steps.iter().filter_map(|s| f.why.get(s.0))).collect();
    let ran = why.iter().any(|w| !matches!(w, Why::Unchanged | Why::NotNeeded));
    let edge = if ran { Stroke::new(2.0, COLORS[0]) } else { Stroke::new(1.0, Color32::from_rgb(0x52, 0x60, 0x6d)) };
    ui.painter().rect(rect, corner, fill, edge, StrokeKind::Inside);
    let line = |y: f32, words: &str, size: f32, color: Color32| {
        text(ui, Pos2::new(rect.center().x, rect.top() + y), Align2::CENTER_CENTER, words, size, color);
    };
    line(14.0, &pass.name, 13.0, TEXT);
    line(30.0, &pass.about, 11.0, FAINT);
    line(45.0, &pass.carried, 11.0, FAINT);
    if let Some(first) = why.first() {
        let head = Rect::from_min_max(rect.min, Pos2::new(rect.right(), rect.top() + 38.0));
        ui.allocate_rect(head, Sense::hover()).on_hover_text(first.to_string());
    }
}

/// A line that leaves and arrives straight down, and an arrow's head where it ends at a pass.
fn wire(ui: &Ui, wire: &Wire) {
    let color = COLORS[wire.port % COLORS.len()];
    let points: Vec<Pos2> = wire.points.iter().map(|[x, y]| Pos2::new(*x, *y)).collect();
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let middle = f32::midpoint(a.y, b.y);
        let curve = [a, Pos2::new(a.x, middle), Pos2::new(b.x, middle), b];
        let stroke = Stroke::new(1.6, color);
        ui.painter().add(CubicBezierShape::from_points_stroke(curve, false, Color32::TRANSPARENT, stroke));
    }
    if let (true, Some(end)) = (wire.arrow, points.last()) {
        let head = vec![*end, *end + Vec2::new(-4.0, -7.0), *end + Vec2::new(4.0, -7.0)];
        ui.painter().add(Shape::convex_polygon(head, color, Stroke::NONE));
    }
}

fn text(ui: &Ui, at: Pos2, align: Align2, words: &str, size: f32, color: Color32) {
    if !words.is_empty() {
        ui.painter().text(at, align, words, FontId::monospace(size), color);
    }
}

fn place(r: crate::plan::show::Rect) -> Rect {
    Rect::from_min_size(Pos2::new(r.x, r.y), Vec2::new(r.width, r.height))
}
