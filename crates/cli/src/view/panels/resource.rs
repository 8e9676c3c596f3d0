//! A resource as it is after the frame: any mip level, layer, face, slice and channel, in any range.

use super::PanelContext;
use crate::view::feed::{ResourceContent, ResourceView};
use crate::view::stage::{ProbedPlace, ResourcePart};
use crate::view::state::PanelState;
use egui::{ColorImage, ComboBox, DragValue, RichText, ScrollArea, Sense, TextureHandle, TextureOptions, Ui, Vec2};
use lightgraph::internals::image::paint::{self, Channel, PaintLook, ValueRange};
use lightgraph::internals::plan::{Desc, TextureKind};
use lightgraph::{Image, Plan};
use std::path::Path;
use std::sync::Arc;

const FACES: [&str; 6] = ["+X", "−X", "+Y", "−Y", "+Z", "−Z"];

/// Which resource and which part of it.
pub fn choose(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    let plan = &subject.plan;
    let mut wanted = state.inspect.clone().unwrap_or(ResourcePart { resource: String::new(), mip: 0, layer: 0 });
    let shown = if wanted.resource.is_empty() { "choose a resource".into() } else { wanted.resource.clone() };
    let combo = ComboBox::from_id_salt("resource").selected_text(shown).width(190.0).height(400.0).show_ui(ui, |ui| {
        for resource in &plan.resources {
            if ui.selectable_label(resource.name == wanted.resource, &resource.name).clicked() {
                wanted = ResourcePart { resource: resource.name.clone(), mip: 0, layer: 0 };
            }
        }
    });
    state.mark("resource", combo.response.rect);
    part(ui, plan, &mut wanted);
    if !wanted.resource.is_empty() {
        state.inspect = Some(wanted);
    }
    look(ui, state);
}

fn part(ui: &mut Ui, plan: &Plan, wanted: &mut ResourcePart) {
    let Some(Desc::Texture(t)) = plan.resources.iter().find(|r| r.name == wanted.resource).map(|r| &r.desc) else {
        return;
    };
    if t.mips > 1 {
        ui.label("mip");
        ui.add(DragValue::new(&mut wanted.mip).range(0..=t.mips - 1));
    }
    if t.layers > 1 {
        let (word, about) = match t.kind {
            TextureKind::D3 => ("slice", String::new()),
            TextureKind::D2 { .. } => ("layer", String::new()),
            TextureKind::Cube { .. } => ("face", FACES[wanted.layer as usize % 6].to_string()),
        };
        ui.label(word);
        ui.add(DragValue::new(&mut wanted.layer).range(0..=t.layers - 1));
        ui.label(about);
    }
}

fn look(ui: &mut Ui, state: &mut PanelState) {
    let mut marks = vec![];
    let look = &mut state.look;
    ui.separator();
    for channel in Channel::ALL {
        let button = ui.selectable_value(&mut look.channel, channel, channel.label());
        marks.push((format!("channel {}", channel.label()), button.rect));
    }
    let colors = egui::Checkbox::new(&mut look.false_color, "false colour");
    let colors = ui.add_enabled(look.channel != Channel::Color, colors).on_hover_text("for a single channel");
    marks.push(("false colour".into(), colors.rect));
    let mut given = look.range.is_some();
    let range = ui.checkbox(&mut given, "range").on_hover_text("without: from the least to the largest number");
    marks.push(("range".into(), range.rect));
    if given != look.range.is_some() {
        look.range = given.then_some([0.0, 1.0]);
    }
    if let Some([low, high]) = &mut look.range {
        ui.add(DragValue::new(low).speed(0.01).max_decimals(5));
        ui.add(DragValue::new(high).speed(0.01).max_decimals(5));
    }
    marks.into_iter().for_each(|(name, rect)| state.mark(name, rect));
}

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(wanted) = &state.inspect else {
        ui.label("Choose a resource, or click one in the compiled graph.");
        return;
    };
    let Some(inspected) = seen.feed.told.inspected.as_ref().filter(|i| i.name == wanted.resource) else {
        let there =
            seen.feed.told.subject.as_ref().is_some_and(|s| s.plan.resources.iter().any(|r| r.name == wanted.resource));
        ui.label(if there { "reading it back …" } else { "This graph has no such resource." });
        return;
    };
    match &inspected.content {
        ResourceContent::Fault(why) => drop(ui.colored_label(ui.visuals().error_fg_color, why)),
        ResourceContent::Words(words, bytes) => numbers(ui, words, *bytes),
        ResourceContent::Plane(image) => {
            let graph = seen.feed.told.subject.as_ref().map(|s| s.path.as_path());
            plane(ui, state, inspected, (image, graph));
        }
    }
}

/// A texture made of a plane, kept until the plane or the look changes.
#[derive(Clone)]
struct PaintedPlane {
    from: Arc<ResourceView>,
    look: PaintLook,
    texture: TextureHandle,
    extent: ValueRange,
}

fn plane(ui: &mut Ui, state: &mut PanelState, inspected: &Arc<ResourceView>, (image, graph): (&Image, Option<&Path>)) {
    let id = egui::Id::unique("plane");
    let kept: Option<PaintedPlane> = ui.data(|d| d.get_temp(id));
    let kept = kept.filter(|k| Arc::ptr_eq(&k.from, inspected) && k.look == state.look);
    let painted = kept.unwrap_or_else(|| {
        let (pixels, extent) = paint::paint(image, state.look);
        let size = [image.width as usize, image.height as usize];
        let pixels = ColorImage::from_rgba_unmultiplied(size, &pixels);
        let texture = ui.ctx().load_texture("plane", pixels, TextureOptions::NEAREST);
        PaintedPlane { from: inspected.clone(), look: state.look, texture, extent }
    });
    ui.data_mut(|d| d.insert_temp(id, painted.clone()));
    let e = painted.extent;
    ui.horizontal(|ui| {
        let finite = format!(
            "{} × {}   {} … {}   mean {}",
            image.width,
            image.height,
            short(e.least),
            short(e.most),
            short(e.mean)
        );
        ui.label(finite);
        if e.not_a_number > 0 {
            ui.colored_label(egui::Color32::from_rgb(255, 0, 255), format!("{} NaN", e.not_a_number));
        }
        if e.infinite > 0 {
            ui.colored_label(egui::Color32::from_rgb(0, 255, 255), format!("{} infinite", e.infinite));
        }
    });
    let room = ui.available_size() - Vec2::new(12.0, 12.0);
    let (w, h) = (image.width.max(1) as f32, image.height.max(1) as f32);
    // Small ones are blown up, large ones scroll.
    let scale = (room.x / w).min(room.y / h).max(1.0 / ui.ctx().pixels_per_point());
    let mut asked = None;
    let area = ScrollArea::both().auto_shrink([false, false]).show(ui, |ui| {
        let (rect, response) = ui.allocate_exact_size(Vec2::new(w, h) * scale, Sense::click());
        egui::Image::new((painted.texture.id(), rect.size())).paint_at(ui, rect);
        if let Some(at) = response.hover_pos() {
            let texel = ((at - rect.min) / scale).max(Vec2::ZERO);
            let (x, y) = (texel.x as u32, texel.y as u32);
            if response.clicked() && ui.input(|i| i.modifiers.command) {
                asked = Some([x, y]);
            }
            if let Some(values) = image.pixel(0, x, y) {
                let values: Vec<String> = values.iter().map(|v| short(*v)).collect();
                response.on_hover_text(RichText::new(format!("({x}, {y})  {}", values.join("  "))).monospace());
            }
        }
        rect
    });
    state.mark("plane", area.inner_rect.intersect(area.inner));
    if let (Some(at), Some(graph)) = (asked, graph) {
        let part = ResourcePart { resource: inspected.name.clone(), mip: inspected.mip, layer: inspected.layer };
        state.ask(graph, ProbedPlace::Texel { part, at });
    }
}

/// The words of a buffer, as floats and as integers.
fn numbers(ui: &mut Ui, words: &[u32], bytes: u64) {
    ui.label(format!("{bytes} bytes; as f32 and as u32"));
    let rows = words.len().div_ceil(4);
    let height = ui.text_style_height(&egui::TextStyle::Monospace);
    ScrollArea::both().auto_shrink([false, false]).show_rows(ui, height, rows, |ui, shown| {
        for row in shown {
            let line: Vec<String> = words[row * 4..(row * 4 + 4).min(words.len())]
                .iter()
                .map(|w| format!("{:>12} {:>10}", short(f32::from_bits(*w)), w))
                .collect();
            ui.label(RichText::new(format!("{:>6}  {}", row * 16, line.join("   "))).monospace());
        }
    });
}

/// A number in few digits.
fn short(v: f32) -> String {
    let size = v.abs();
    if v == 0.0 || (1e-3..1e5).contains(&size) || !v.is_finite() { format!("{v:.4}") } else { format!("{v:.3e}") }
}
