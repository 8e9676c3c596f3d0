//! The image in the middle: what the pointer does on it, the marks of lights and of what is selected, the names of the
//! halves.

use super::{PanelContext, stem};
use crate::view::choice::{ComparedTo, SplitLayout};
use crate::view::pick::{self, Draggable};
use crate::view::stage::ProbedPlace;
use crate::view::state::{Gesture, PanelState, Tab};
use egui::{
    Align2, Color32, FontId, Key, PointerButton, Pos2, Rect, Response, Sense, Shape, Stroke, StrokeKind, Ui, Vec2,
};
use glam::Vec3;
use lightgraph::internals::scene::{Bounds, Geometry, LightKind, Pose, navigate};
use lightgraph::internals::session::Pointer;
use lightgraph::{Scene, View};
use std::path::PathBuf;

const MARK: Color32 = Color32::from_rgb(0xff, 0xd7, 0x66);
/// What the image leaves to the edges of the panels, in points.
const EDGE: f32 = 4.0;
/// How near the line between two images the pointer takes hold of it, in points.
const GRIP: f32 = 6.0;

/// Shows the image; returns where it is.
pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) -> Rect {
    let area = ui.available_rect_before_wrap();
    let ppp = ui.ctx().pixels_per_point();
    state.room = [area.width(), area.height()].map(|n| (n.max(0.0) * ppp).round() as u32);
    ui.allocate_rect(area, Sense::hover());
    // The edges of the panels around are theirs to drag.
    let response = ui.interact(area.shrink(EDGE), ui.scope_id().with("image"), Sense::click_and_drag());
    state.mark("image", area);
    let Some(shown) = seen.image else {
        let text = if seen.feed.told.faults.is_empty() { "making the first frame …" } else { "" };
        let font = FontId::proportional(16.0);
        ui.painter().text(area.center(), Align2::CENTER_CENTER, text, font, Color32::from_gray(140));
        return area;
    };
    let [w, h] = shown.size.map(|n| n as f32);
    let scale = (area.width() / w).min(area.height() / h).max(0.0);
    let rect = Rect::from_center_size(area.center(), Vec2::new(w, h) * scale);
    ui.painter().image(shown.id, rect, Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0)), Color32::WHITE);
    halves(ui, state, seen, rect);
    let Some(subject) = &seen.feed.told.subject else { return area };
    state.pointer = match told(ui, &response, rect, shown.size) {
        Some(pointer) if subject.points => pointer,
        _ => Pointer { buttons: 0, ..state.pointer },
    };
    if asks(ui, &response)
        && let Some(at) = response.interact_pointer_pos().filter(|at| rect.contains(*at))
        && let Some(graph) = shown_at(state, seen, rect, at)
    {
        let share = (at - rect.min) / rect.size();
        let texel = |share: f32, count: u32| ((share * count as f32) as u32).min(count.saturating_sub(1));
        state.ask(&graph, ProbedPlace::Pixel([texel(share.x, shown.size[0]), texel(share.y, shown.size[1])]));
    }
    asked(ui, state, rect, shown.size);
    let scene = &subject.scene;
    let (pose, aspect) = (state.pose(scene, seen.time), w / h.max(1.0));
    if let Some(view) = state.view(scene, &pose, aspect) {
        pointer(ui, state, &response, rect, scene, &pose, view, seen);
        marks(ui, state, rect, scene, &pose, view, aspect);
    }
    area
}

/// Whether a click asks what is computed: Ctrl is held, or Command on a Mac.
fn asks(ui: &Ui, response: &Response) -> bool {
    response.clicked() && ui.input(|i| i.modifiers.command)
}

/// The graph whose image is seen at a place; `None`: an image file is.
fn shown_at(state: &PanelState, seen: &PanelContext, rect: Rect, at: Pos2) -> Option<PathBuf> {
    let told = &seen.feed.told;
    let other = match state.now().compare.layout {
        SplitLayout::Split(share) => at.x > rect.left() + share * rect.width(),
        SplitLayout::Difference(_) => false,
        SplitLayout::Other => true,
    };
    match &state.now().compare.against {
        ComparedTo::Graph(path) if other && told.other.is_some() => Some(path.clone()),
        ComparedTo::Image(_) if other && told.other.is_some() => None,
        _ => told.subject.as_ref().map(|s| s.path.clone()),
    }
}

/// The pixel that was asked for.
fn asked(ui: &Ui, state: &PanelState, rect: Rect, size: [u32; 2]) {
    let of = state.ask.as_ref().filter(|_| state.sees(Tab::Probe)).map(|a| &a.of);
    if let Some(ProbedPlace::Pixel([x, y])) = of {
        let texel = rect.size() / Vec2::new(size[0].max(1) as f32, size[1].max(1) as f32);
        let at = rect.min + Vec2::new(*x as f32 + 0.5, *y as f32 + 0.5) * texel;
        let edge = Rect::from_center_size(at, texel.max(Vec2::splat(7.0)));
        let painter = ui.painter().with_clip_rect(rect);
        for (width, color) in [(3.0, Color32::from_black_alpha(150)), (1.0, MARK)] {
            painter.rect_stroke(edge, 0.0, Stroke::new(width, color), StrokeKind::Outside);
        }
    }
}

/// Where the pointer is over the image, for shaders.
fn told(ui: &Ui, response: &Response, rect: Rect, size: [u32; 2]) -> Option<Pointer> {
    let at = response.hover_pos()?;
    let share = glam::Vec2::new((at.x - rect.left()) / rect.width(), (at.y - rect.top()) / rect.height());
    let buttons = [PointerButton::Primary, PointerButton::Secondary, PointerButton::Middle];
    let down = |(bit, button): (usize, &PointerButton)| u32::from(ui.input(|i| i.pointer.button_down(*button))) << bit;
    let at = share * glam::UVec2::from(size).as_vec2();
    Some(Pointer { at, buttons: buttons.iter().enumerate().map(down).sum() })
}

#[allow(clippy::too_many_arguments)] // What a pointer event means depends on all of them.
fn pointer(
    ui: &Ui,
    state: &mut PanelState,
    response: &Response,
    rect: Rect,
    scene: &Scene,
    pose: &Pose,
    view: View,
    seen: &PanelContext,
) {
    let place = |at: Pos2| glam::Vec2::new((at.x - rect.left()) / rect.width(), (at.y - rect.top()) / rect.height());
    let aspect = rect.width() / rect.height();
    let origin = ui.input(|i| i.pointer.press_origin());
    if response.drag_started() {
        state.gesture = origin.map(|at| {
            let shift = ui.input(|i| i.modifiers.shift);
            let line = split_line(state, seen, rect);
            if response.dragged_by(PointerButton::Secondary) {
                Gesture::Look
            } else if response.dragged_by(PointerButton::Middle) || shift {
                Gesture::Pan
            } else if line.is_some_and(|x| (at.x - x).abs() < GRIP) {
                Gesture::Split
            } else {
                match pick::thing(scene, pose, view, aspect, place(at)) {
                    // A light can be taken at once, an object only once it is selected: most drags turn the view.
                    Some((thing, point)) if matches!(thing, Draggable::Light(_)) || state.selected == Some(thing) => {
                        state.selected = Some(thing);
                        Gesture::Move(thing, point)
                    }
                    _ => Gesture::Orbit,
                }
            }
        });
    }
    if let Some(gesture) = state.gesture
        && response.dragged()
    {
        let by = response.drag_delta() / rect.height();
        match (gesture, response.interact_pointer_pos()) {
            (Gesture::Split, Some(at)) => {
                let share = place(at).x.clamp(0.0, 1.0);
                state.edit("layout", |c| c.compare.layout = SplitLayout::Split(share));
            }
            _ if by != Vec2::ZERO => state.drag(gesture, scene, view, glam::Vec2::new(by.x, by.y)),
            _ => {}
        }
    }
    if response.drag_stopped() {
        state.gesture = None;
    }
    if response.clicked()
        && !asks(ui, response)
        && let Some(at) = response.interact_pointer_pos()
    {
        state.selected = pick::thing(scene, pose, view, aspect, place(at)).map(|t| t.0);
    }
    if response.double_clicked()
        && let Some(at) = response.interact_pointer_pos()
    {
        // From now on the view turns round what was clicked.
        state.pivot = pick::surface(scene, pose, view, aspect, place(at)).map(|s| s.1);
    }
    if response.hovered() {
        let wheel = ui.input(|i| i.smooth_scroll_delta().y);
        if wheel != 0.0 {
            state.set_view("zoom", navigate::zoom(view, state.pivot(scene, view), wheel / 30.0));
        }
    }
    fly(ui, state, scene, view);
}

/// Keys that fly: W A S D, Q down and E up; Shift is faster.
fn fly(ui: &Ui, state: &mut PanelState, scene: &Scene, view: View) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let by = ui.input(|i| {
        let axis = |more: Key, less: Key| f32::from(i.key_down(more)) - f32::from(i.key_down(less));
        let free = !i.modifiers.command && !i.modifiers.alt;
        let speed = scene.bounds.diagonal() * 0.15 * if i.modifiers.shift { 4.0 } else { 1.0 };
        let way = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        if free { way * speed * i.stable_dt.min(0.1) } else { Vec3::ZERO }
    });
    if by != Vec3::ZERO {
        state.pivot = None;
        state.set_view("fly", navigate::fly(view, by));
        ui.ctx().request_repaint();
    } else if ui.input(|i| i.events.iter().any(|e| matches!(e, egui::Event::Key { pressed: false, .. }))) {
        state.choice.rest();
    }
}

/// Lights, and the box of what is selected.
fn marks(ui: &Ui, state: &mut PanelState, rect: Rect, scene: &Scene, pose: &Pose, view: View, aspect: f32) {
    let painter = ui.painter().with_clip_rect(rect);
    let seen = |p: Vec3| pick::project(view, aspect, p).map(|at| rect.min + Vec2::new(at.x, at.y) * rect.size());
    for (i, light) in pose.lights.iter().enumerate() {
        let Some(at) = seen(light.position) else { continue };
        let chosen = state.selected == Some(Draggable::Light(i));
        let width = if chosen { 2.5 } else { 1.5 };
        painter.circle_stroke(at, 7.0, Stroke::new(width + 1.5, Color32::from_black_alpha(150)));
        painter.circle(at, 7.0, MARK.gamma_multiply(if chosen { 0.6 } else { 0.15 }), Stroke::new(width, MARK));
        // A point light has no direction.
        let directed = scene.lights.get(i).is_some_and(|l| l.kind != LightKind::Point);
        if let Some(tip) = seen(light.position + light.direction * scene.bounds.diagonal() * 0.04).filter(|_| directed)
        {
            painter.line_segment([at, tip], Stroke::new(width, MARK));
        }
        state.mark(format!("light {i}"), Rect::from_center_size(at, Vec2::splat(14.0)));
    }
    if let Some(Draggable::Node(node)) = state.selected {
        let Geometry { vertices, owners, .. } = &*scene.geometry;
        let of_node = vertices.iter().filter(|v| owners.node(v.node) as usize == node);
        let placed = of_node.filter_map(|v| Some(pose.nodes.get(v.node as usize)?.transform_point3(v.position.into())));
        let bounds = Bounds::of(placed);
        if bounds.min.x > bounds.max.x {
            return;
        }
        let corners = bounds.corners();
        for a in 0..8usize {
            for bit in [1, 2, 4] {
                let b = a | bit;
                if let (true, Some(p), Some(q)) = (a != b, seen(corners[a]), seen(corners[b])) {
                    painter.add(Shape::dashed_line(&[p, q], Stroke::new(1.5, MARK), 6.0, 4.0));
                }
            }
        }
    }
}

/// Where the line between two images is.
fn split_line(state: &PanelState, seen: &PanelContext, rect: Rect) -> Option<f32> {
    match state.now().compare.layout {
        SplitLayout::Split(at) if seen.feed.told.other.is_some() => Some(rect.left() + at * rect.width()),
        SplitLayout::Split(_) | SplitLayout::Difference(_) | SplitLayout::Other => None,
    }
}

/// The line between two images, and their names.
fn halves(ui: &Ui, state: &mut PanelState, seen: &PanelContext, rect: Rect) {
    let against = match &state.now().compare.against {
        ComparedTo::Nothing => return,
        ComparedTo::Graph(path) | ComparedTo::Image(path) => stem(path),
    };
    let Some(subject) = &seen.feed.told.subject else { return };
    let name = |at: Pos2, align: Align2, text: &str| {
        let font = FontId::proportional(13.0);
        let galley = ui.painter().layout_no_wrap(text.to_string(), font, Color32::WHITE);
        let place = align.anchor_size(at, galley.size());
        ui.painter().rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(160));
        ui.painter().galley(place.min, galley, Color32::WHITE);
    };
    let top = rect.top() + 8.0;
    if let Some(x) = split_line(state, seen, rect) {
        let line = [Pos2::new(x, rect.top()), Pos2::new(x, rect.bottom())];
        ui.painter().line_segment(line, Stroke::new(3.0, Color32::from_black_alpha(140)));
        ui.painter().line_segment(line, Stroke::new(1.0, Color32::WHITE));
        name(Pos2::new(x - 8.0, top), Align2::RIGHT_TOP, &stem(&subject.path));
        name(Pos2::new(x + 8.0, top), Align2::LEFT_TOP, &against);
        let line = Rect::from_min_max(line[0], line[1]).expand2(Vec2::new(1.0, 0.0));
        state.mark("split line", line);
    } else if seen.feed.told.other.is_some() {
        let text = match state.now().compare.layout {
            SplitLayout::Difference(_) => format!("{} − {against}", stem(&subject.path)),
            SplitLayout::Split(_) | SplitLayout::Other => against,
        };
        name(Pos2::new(rect.left() + 8.0, top), Align2::LEFT_TOP, &text);
    }
}
