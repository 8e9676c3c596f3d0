//! The compiled graph as a picture: passes as boxes, wires from what writes to what reads. A click on a resource shows
//! it.

use super::Seen;
use crate::view::feed::{Rendered, Subject};
use crate::view::state::{State, Zoom};
use egui::epaint::CubicBezierShape;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, RichText, Sense, Shape, Stroke, StrokeKind, Ui, Vec2};
use lightgraph::internals::plan::change::Why;
use lightgraph::internals::plan::show::{PassBox, Wire};

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
        state.network = None;
    }
    ui.label(RichText::new("drag to move, scroll to zoom, click a resource to see it").weak());
}

pub fn show(ui: &mut Ui, state: &mut State, seen: &Seen) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let (panel, response) = ui.allocate_exact_size(ui.available_size().max(Vec2::ZERO), Sense::click_and_drag());
    let size = Vec2::new(subject.picture.width, subject.picture.height);
    let mut zoom = state.network.unwrap_or(Zoom::whole(size, panel.size()));
    zoom.offset += response.drag_delta();
    if let Some(at) = response.hover_pos() {
        let (wheel, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        zoom = zoom.by(pinch * (wheel * 0.004).exp(), at - panel.min);
    }
    if zoom != state.network.unwrap_or(Zoom::whole(size, panel.size())) {
        state.network = Some(zoom);
    }
    let brush =
        Brush { painter: ui.painter().with_clip_rect(panel), corner: panel.min + zoom.offset, scale: zoom.scale };
    let frame = seen.feed.told.frame.as_deref();
    draw(ui, &brush, state, subject, frame);
}

/// Paints in the picture's lengths.
struct Brush {
    painter: Painter,
    corner: Pos2,
    scale: f32,
}

impl Brush {
    fn at(&self, x: f32, y: f32) -> Pos2 {
        self.corner + Vec2::new(x, y) * self.scale
    }

    fn rect(&self, r: lightgraph::internals::plan::show::Rect) -> Rect {
        Rect::from_min_size(self.at(r.x, r.y), Vec2::new(r.width, r.height) * self.scale)
    }

    fn framed(
        &self,
        r: lightgraph::internals::plan::show::Rect,
        corner: f32,
        fill: Color32,
        width: f32,
        edge: Color32,
    ) {
        let stroke = Stroke::new((width * self.scale).max(0.6), edge);
        self.painter.rect(self.rect(r), corner * self.scale, fill, stroke, StrokeKind::Inside);
    }

    fn text(&self, at: Pos2, align: Align2, words: &str, size: f32, color: Color32) {
        let size = size * self.scale;
        // Smaller than this nobody reads it.
        if !words.is_empty() && size > 3.0 {
            self.painter.text(at, align, words, FontId::monospace(size), color);
        }
    }
}

fn draw(ui: &Ui, brush: &Brush, state: &mut State, subject: &Subject, frame: Option<&Rendered>) {
    let picture = &subject.picture;
    for (_, rect) in &picture.loops {
        brush.framed(*rect, 10.0, Color32::from_white_alpha(8), 1.0, FAINT);
    }
    for w in &picture.wires {
        wire(brush, w);
    }
    for (title, rect) in &picture.loops {
        brush.text(brush.at(rect.x + 12.0, rect.y + 12.0), Align2::LEFT_CENTER, &format!("loop {title}"), 13.0, TEXT);
    }
    let mut open = None;
    for pass in &picture.boxes {
        pass_box(ui, brush, pass, frame);
        for port in &pass.ports {
            let rect = brush.rect(port.rect);
            let shown = rect.intersect(brush.painter.clip_rect());
            let color = COLORS[port.port % COLORS.len()];
            let name = port.ids.first().and_then(|id| subject.plan.resources.get(id.0)).map(|r| &r.name);
            let mut fill = Color32::from_gray(24);
            if shown.is_positive() {
                let response = ui.interact(shown, ui.scope_id().with(("port", port.port)), Sense::click());
                if response.hovered() {
                    fill = color.gamma_multiply(0.4);
                }
                if response.clicked() {
                    open = name;
                }
                state.mark(format!("port {}", port.resource), shown);
            }
            brush.framed(port.rect, 4.0, fill, 1.6, color);
            brush.text(rect.center(), Align2::CENTER_CENTER, &port.resource, 11.0, TEXT);
        }
    }
    if let Some(name) = open {
        state.open(name);
    }
}

fn pass_box(ui: &Ui, brush: &Brush, pass: &PassBox, frame: Option<&Rendered>) {
    let (fill, corner) = match pass.kind {
        "draw" | "screen" => (Color32::from_rgb(0x1c, 0x2b, 0x3d), 6.0),
        "compute" => (Color32::from_rgb(0x1a, 0x30, 0x28), 6.0),
        "output" => (Color32::from_rgb(0x3a, 0x30, 0x18), pass.rect.height / 2.0),
        _ => (Color32::from_rgb(0x26, 0x2b, 0x31), 6.0),
    };
    let why: Vec<&Why> = frame.iter().flat_map(|f| pass.steps.iter().filter_map(|s| f.why.get(s.0))).collect();
    let ran = why.iter().any(|w| w.runs());
    let (width, edge) = if ran { (2.0, COLORS[0]) } else { (1.0, Color32::from_rgb(0x52, 0x60, 0x6d)) };
    brush.framed(pass.rect, corner, fill, width, edge);
    let line = |y: f32, words: &str, size: f32, color: Color32| {
        let at = brush.at(pass.rect.x + pass.rect.width / 2.0, pass.rect.y + y);
        brush.text(at, Align2::CENTER_CENTER, words, size, color);
    };
    line(14.0, &pass.name, 13.0, TEXT);
    line(30.0, &pass.about, 11.0, FAINT);
    line(45.0, &pass.carried, 11.0, FAINT);
    let head = brush
        .rect(lightgraph::internals::plan::show::Rect { height: 38.0, ..pass.rect })
        .intersect(brush.painter.clip_rect());
    if let (Some(first), true) = (why.first(), head.is_positive()) {
        ui.interact(head, ui.scope_id().with(("pass", &pass.name)), Sense::hover()).on_hover_text(first.to_string());
    }
}

/// A line that leaves and arrives straight down, and an arrow's head where it ends at a pass.
fn wire(brush: &Brush, wire: &Wire) {
    let color = COLORS[wire.port % COLORS.len()];
    let points: Vec<Pos2> = wire.points.iter().map(|[x, y]| brush.at(*x, *y)).collect();
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let middle = f32::midpoint(a.y, b.y);
        let curve = [a, Pos2::new(a.x, middle), Pos2::new(b.x, middle), b];
        let stroke = Stroke::new((1.6 * brush.scale).max(0.6), color);
        brush.painter.add(CubicBezierShape::from_points_stroke(curve, false, Color32::TRANSPARENT, stroke));
    }
    if let (true, Some(end)) = (wire.arrow, points.last()) {
        let head = vec![*end, *end + Vec2::new(-4.0, -7.0) * brush.scale, *end + Vec2::new(4.0, -7.0) * brush.scale];
        brush.painter.add(Shape::convex_polygon(head, color, Stroke::NONE));
    }
}
