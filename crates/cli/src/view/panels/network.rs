//! The compiled graph as a picture: passes as boxes, wires from what writes to what reads. A click on a resource shows
//! it, one on a pass opens its file; sub-graphs can be one box each.

use super::PanelContext;
use crate::show::{COLLAPSED, PassBox, Picture, WireLine, picture, sub_graphs};
use crate::view::editor;
use crate::view::feed::{ShownFrame, Subject};
use crate::view::state::{PanelState, Zoom};
use egui::epaint::CubicBezierShape;
use egui::{
    Align2, Color32, FontId, Painter, Pos2, Rect, RichText, Sense, Shape, Stroke, StrokeKind, TextEdit, Ui, Vec2,
};
use lightgraph::Plan;
use lightgraph::internals::diag::Span;
use lightgraph::internals::graph::ast::walk;
use lightgraph::internals::plan::change::Why;
use std::collections::BTreeSet;
use std::sync::Arc;

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
/// Of passes that the plan leaves out, and the room of their column.
const CULLED: Color32 = Color32::from_rgb(0xc0, 0x7a, 0x7a);
const CULLED_WIDTH: f32 = 300.0;
const FAINT: Color32 = Color32::from_rgb(0x9a, 0xa5, 0xb1);

pub fn summary(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let plan = &subject.plan;
    for (label, declared) in [("compiled", false), ("declared", true)] {
        let button = ui.selectable_value(&mut state.network.declared, declared, label);
        state.mark(label, button.rect);
    }
    ui.label(format!("{} steps, {} resources", plan.steps.len(), plan.resources.len()));
    let fit = ui.button("fit").on_hover_text("the whole graph; drag to move, scroll to zoom");
    if fit.clicked() {
        state.network.zoom = None;
    }
    let search =
        TextEdit::singleline(&mut state.network.search).hint_text("find a pass or resource").desired_width(160.0);
    let search = ui.add(search);
    state.mark("find", search.rect);
    if search.changed() {
        state.network.zoom = None;
    }
    sub_graph_menu(ui, state, plan);
    if !plan.skipped.is_empty() {
        let list: Vec<String> = plan.skipped.iter().map(|(name, why)| format!("{name}: {why}")).collect();
        let culled = ui.label(RichText::new(format!("{} left out of the plan", plan.skipped.len())).color(CULLED));
        culled.on_hover_text(list.join("\n"));
    }
    ui.label(RichText::new("click: a resource is shown, a pass opens in $EDITOR").weak());
}

/// Which sub-graphs are one box each.
fn sub_graph_menu(ui: &mut Ui, state: &mut PanelState, plan: &Plan) {
    let all: BTreeSet<&str> = plan.steps.iter().flat_map(|s| sub_graphs(&s.pass)).collect();
    if all.is_empty() {
        return;
    }
    let collapsed = &mut state.network.collapsed;
    let menu = ui.menu_button("sub-graphs", |ui| {
        for name in &all {
            let mut one = collapsed.contains(*name);
            if ui.checkbox(&mut one, *name).on_hover_text("one box").changed() {
                if one {
                    collapsed.insert((*name).to_string())
                } else {
                    collapsed.remove(*name)
                };
            }
        }
    });
    state.mark("sub-graphs", menu.response.rect);
    let every = all.iter().all(|name| state.network.collapsed.contains(*name));
    let button = ui.small_button(if every { "open all" } else { "collapse all" });
    state.mark("collapse", button.rect);
    if button.clicked() {
        let names = all.iter().map(|name| (*name).to_string());
        state.network.collapsed = if every { BTreeSet::new() } else { names.collect() };
        state.network.zoom = None;
    }
}

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let (panel, response) = ui.allocate_exact_size(ui.available_size().max(Vec2::ZERO), Sense::click_and_drag());
    let drawn = drawn(state, subject);
    let culled = if subject.plan.skipped.is_empty() { 0.0 } else { CULLED_WIDTH };
    let size = Vec2::new(drawn.2.width + culled, drawn.2.height);
    let search = state.network.search.to_lowercase();
    let start = match found(&drawn.2, &search) {
        // What is found stands in the middle, as large as life.
        Some(rect) => {
            let middle = Vec2::new(rect.x + culled + rect.width / 2.0, rect.y + rect.height / 2.0);
            Zoom { scale: 1.0, offset: panel.size() * 0.5 - middle }
        }
        None => Zoom::whole(size, panel.size()),
    };
    let mut zoom = state.network.zoom.unwrap_or(start);
    zoom.offset += response.drag_delta();
    if let Some(at) = response.hover_pos() {
        let (wheel, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        zoom = zoom.by(pinch * (wheel * 0.004).exp(), at - panel.min);
    }
    if zoom != state.network.zoom.unwrap_or(start) {
        state.network.zoom = Some(zoom);
    }
    let corner = panel.min + zoom.offset + Vec2::new(culled * zoom.scale, 0.0);
    let brush = Brush { painter: ui.painter().with_clip_rect(panel), corner, scale: zoom.scale, search };
    draw_culled(&brush, subject);
    let frame = seen.feed.told.frame.as_deref();
    draw(ui, &brush, state, (subject, &drawn.2), frame);
    state.network.drawn = Some(drawn);
}

/// The picture of what is shown; that of the last frame of the window where nothing changed.
fn drawn(state: &mut PanelState, subject: &Arc<Subject>) -> (Arc<Subject>, BTreeSet<String>, Picture) {
    let collapsed = &state.network.collapsed;
    let last = state.network.drawn.take();
    last.filter(|(of, with, _)| Arc::ptr_eq(of, subject) && with == collapsed)
        .unwrap_or_else(|| (subject.clone(), collapsed.clone(), picture(&subject.plan, collapsed)))
}

/// The first box whose name, or that of what it writes, holds what is looked for.
fn found(picture: &Picture, search: &str) -> Option<crate::show::Rect> {
    let hit = |name: &str| !search.is_empty() && name.to_lowercase().contains(search);
    let named = picture.boxes.iter().find(|b| hit(&b.name));
    named.or_else(|| picture.boxes.iter().find(|b| b.ports.iter().any(|p| hit(&p.resource)))).map(|b| b.rect)
}

/// Passes that the plan leaves out, in a column of their own.
fn draw_culled(brush: &Brush, subject: &Subject) {
    let mut y = 0.0;
    for (name, why) in &subject.plan.skipped {
        let rect = crate::show::Rect { x: -CULLED_WIDTH, y, width: CULLED_WIDTH - 40.0, height: 40.0 };
        let at = brush.rect(rect);
        if at.intersects(brush.painter.clip_rect()) {
            let corners = [at.left_top(), at.right_top(), at.right_bottom(), at.left_bottom(), at.left_top()];
            let stroke = Stroke::new(brush.scale.max(0.6), brush.tint(name, CULLED));
            for pair in corners.windows(2) {
                brush.painter.extend(Shape::dashed_line(pair, stroke, 5.0 * brush.scale, 4.0 * brush.scale));
            }
            let clip = at.intersect(brush.painter.clip_rect());
            let inside = Brush { painter: brush.painter.with_clip_rect(clip), ..brush.clone() };
            inside.text(at.left_center() + Vec2::new(8.0, -8.0) * brush.scale, Align2::LEFT_CENTER, name, 13.0, CULLED);
            inside.text(at.left_center() + Vec2::new(8.0, 9.0) * brush.scale, Align2::LEFT_CENTER, why, 9.0, FAINT);
        }
        y += 48.0;
    }
}

/// Paints in the picture's lengths.
#[derive(Clone)]
struct Brush {
    painter: Painter,
    corner: Pos2,
    scale: f32,
    /// What is looked for, in small letters; all else is faint.
    search: String,
}

impl Brush {
    /// The colour of what has a name.
    fn tint(&self, name: &str, color: Color32) -> Color32 {
        let wanted = self.search.is_empty() || name.to_lowercase().contains(&self.search);
        if wanted { color } else { color.gamma_multiply(0.3) }
    }

    fn at(&self, x: f32, y: f32) -> Pos2 {
        self.corner + Vec2::new(x, y) * self.scale
    }

    fn rect(&self, r: crate::show::Rect) -> Rect {
        Rect::from_min_size(self.at(r.x, r.y), Vec2::new(r.width, r.height) * self.scale)
    }

    fn framed(&self, r: crate::show::Rect, corner: f32, fill: Color32, width: f32, edge: Color32) {
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

fn draw(
    ui: &Ui,
    brush: &Brush,
    state: &mut PanelState,
    (subject, picture): (&Subject, &Picture),
    frame: Option<&ShownFrame>,
) {
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
        pass_box(ui, brush, state, pass, (subject, frame));
        for port in &pass.ports {
            let rect = brush.rect(port.rect);
            let shown = rect.intersect(brush.painter.clip_rect());
            let color = brush.tint(&port.resource, COLORS[port.port % COLORS.len()]);
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
            brush.text(rect.center(), Align2::CENTER_CENTER, &port.resource, 11.0, brush.tint(&port.resource, TEXT));
        }
    }
    if let Some(name) = open {
        state.open(name);
    }
}

fn pass_box(
    ui: &Ui,
    brush: &Brush,
    state: &mut PanelState,
    pass: &PassBox,
    (subject, frame): (&Subject, Option<&ShownFrame>),
) {
    let (fill, corner) = match pass.kind {
        "draw" | "screen" => (Color32::from_rgb(0x1c, 0x2b, 0x3d), 6.0),
        "compute" => (Color32::from_rgb(0x1a, 0x30, 0x28), 6.0),
        "output" => (Color32::from_rgb(0x3a, 0x30, 0x18), pass.rect.height / 2.0),
        COLLAPSED => (Color32::from_rgb(0x31, 0x24, 0x38), 2.0),
        _ => (Color32::from_rgb(0x26, 0x2b, 0x31), 6.0),
    };
    let why: Vec<&Why> = frame.iter().flat_map(|f| pass.steps.iter().filter_map(|s| f.why.get(s.0))).collect();
    let ran = why.iter().any(|w| w.runs());
    let (width, edge) = if ran { (2.0, COLORS[0]) } else { (1.0, Color32::from_rgb(0x52, 0x60, 0x6d)) };
    brush.framed(pass.rect, corner, fill, width, brush.tint(&pass.name, edge));
    let line = |y: f32, words: &str, size: f32, color: Color32| {
        let at = brush.at(pass.rect.x + pass.rect.width / 2.0, pass.rect.y + y);
        brush.text(at, Align2::CENTER_CENTER, words, size, color);
    };
    line(14.0, &pass.name, 13.0, brush.tint(&pass.name, TEXT));
    line(30.0, &pass.about, 11.0, FAINT);
    line(45.0, &pass.carried, 11.0, FAINT);
    let head = brush.rect(crate::show::Rect { height: 38.0, ..pass.rect }).intersect(brush.painter.clip_rect());
    if !head.is_positive() || pass.steps.is_empty() {
        return;
    }
    state.mark(format!("pass {}", pass.name), head);
    let head = ui.interact(head, ui.scope_id().with(("pass", &pass.name)), Sense::click());
    if head.clicked() {
        if pass.kind == COLLAPSED {
            state.network.collapsed.remove(&pass.name);
        } else {
            state.message = place(subject, pass).map(|place| match editor::open(&place) {
                Ok(told) => (true, told),
                Err(why) => (false, why),
            });
        }
    }
    if let Some(first) = why.first() {
        head.on_hover_text(first.to_string());
    }
}

/// Where the graph names a pass.
fn place(subject: &Subject, pass: &PassBox) -> Option<Span> {
    let name = &subject.plan.steps.get(pass.steps.first()?.0)?.pass;
    let mut found = None;
    walk(&subject.graph.passes, &mut |p| {
        if p.name.value == *name {
            found.get_or_insert_with(|| p.name.span.clone());
        }
    });
    found
}

/// A line that leaves and arrives straight down, and an arrow's head where it ends at a pass.
fn wire(brush: &Brush, wire: &WireLine) {
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
