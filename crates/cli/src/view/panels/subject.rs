//! The scene and its time, how the image is made and shown, what is selected, what can be saved.

use super::{PanelContext, stem};
use crate::view::choice::Resolution;
use crate::view::pick::Draggable;
use crate::view::state::{PanelState, Save};
use egui::{ComboBox, DragValue, RichText, Slider, Ui};
use glam::Vec3;
use lightgraph::Scene;
use lightgraph::internals::image::exposure::Exposure;
use lightgraph::internals::image::png::ToneMap;

/// Scene, camera, time, what is selected.
pub fn scene(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let current = state.now().scene.clone();
    let mut chosen = None;
    ComboBox::from_id_salt("scene").selected_text(stem(&current)).width(200.0).show_ui(ui, |ui| {
        for path in seen.scenes {
            if ui.selectable_label(stem(path) == stem(&current), stem(path)).clicked() {
                chosen = Some(path.clone());
            }
        }
    });
    if let Some(path) = chosen {
        state.set_scene(path);
    }
    if let Some(text) = seen.link {
        let words = match &state.linked.program {
            Some(program) => format!("{program} is connected"),
            None => format!("waits for a program at\n{text}"),
        };
        let label = ui.add(egui::Label::new(RichText::new(words).small()).selectable(true));
        state.mark("link", label.rect);
    }
    let Some(subject) = &seen.feed.told.subject else { return };
    let scene = &subject.scene;
    camera(ui, state, scene);
    let end = scene.duration();
    if end > 0.0 {
        let mut time = seen.time.rem_euclid(end);
        let slider = ui.add(Slider::new(&mut time, 0.0..=end).text("time").suffix(" s"));
        if slider.changed() {
            state.playing = false;
            state.edit("time", |c| c.time = time);
        }
        state.mark("time", slider.rect);
    }
    selected(ui, state, scene);
}

fn camera(ui: &mut Ui, state: &mut PanelState, scene: &Scene) {
    let named = state.now().camera.clone();
    let moved = state.now().view.is_some();
    ui.horizontal(|ui| {
        let shown = named.clone().unwrap_or_else(|| "default camera".into());
        let mut chosen = None;
        ComboBox::from_id_salt("camera").selected_text(shown).width(140.0).show_ui(ui, |ui| {
            if ui.selectable_label(named.is_none(), "default camera").clicked() {
                chosen = Some(None);
            }
            for camera in &scene.cameras {
                if ui.selectable_label(named.as_ref() == Some(&camera.name), &camera.name).clicked() {
                    chosen = Some(Some(camera.name.clone()));
                }
            }
        });
        if let Some(camera) = chosen {
            state.edit("camera", |c| (c.camera, c.view) = (camera, None));
            state.choice.rest();
        }
        let back = ui.add_enabled(moved, egui::Button::new("go back")).on_hover_text("to where the camera is (Home)");
        if back.clicked() {
            state.edit("view", |c| c.view = None);
            state.choice.rest();
        }
        state.mark("go back", back.rect);
    });
    let help = "drag: orbit · right: look, with WASD QE: fly · middle: pan · wheel: zoom · click: select, then drag it";
    ui.label(RichText::new(help).small().weak());
}

fn selected(ui: &mut Ui, state: &mut PanelState, scene: &Scene) {
    let Some(thing) = state.selected else { return };
    let (word, name, moved) = match thing {
        Draggable::Light(i) => ("light", scene.lights.get(i).map(|l| &l.name), state.now().lights.get(&i)),
        Draggable::Node(i) => ("object", scene.nodes.get(i).map(|n| &n.name), state.now().nodes.get(&i)),
    };
    let Some(name) = name else { return };
    let mut by = moved.copied().unwrap_or(Vec3::ZERO);
    let before = by;
    let row = ui.horizontal(|ui| {
        ui.label(format!("{word} {name}"));
        if ui.small_button("put back").clicked() {
            by = Vec3::ZERO;
        }
    });
    state.mark("selected", row.response.rect);
    ui.horizontal(|ui| {
        ui.label("moved by");
        for (axis, v) in ["x ", "y ", "z "].into_iter().zip(by.as_mut()) {
            ui.add(DragValue::new(v).speed(0.01).prefix(axis).max_decimals(3));
        }
    });
    if by != before {
        state.move_thing(thing, by - before);
    }
}

/// Exposure, tone map, how many pixels.
pub fn image(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let automatic = state.now().exposure == Exposure::Auto;
    let mut stops = state.now().stops(seen.feed.told.automatic);
    let slider = ui.add(Slider::new(&mut stops, -20.0..=20.0).text("exposure").suffix(" EV"));
    if slider.changed() {
        state.edit("exposure", |c| c.exposure = Exposure::Stops(stops));
    }
    let rail = ui.spacing().slider_width;
    state.mark("exposure", egui::Rect::from_min_size(slider.rect.min, egui::Vec2::new(rail, slider.rect.height())));
    let mut wanted = automatic;
    let about = "brings what is dark, or lit in lux, to a middle grey; leaves the rest as it is";
    let by_itself = ui.checkbox(&mut wanted, "automatic exposure").on_hover_text(about);
    if wanted != automatic {
        state.edit("exposure", |c| c.exposure = if wanted { Exposure::Auto } else { Exposure::Stops(stops) });
    }
    state.mark("automatic exposure", by_itself.rect);
    ui.horizontal(|ui| {
        let mut tone_map = state.now().tone_map;
        ui.label("tone map");
        ui.selectable_value(&mut tone_map, ToneMap::Neutral, "neutral");
        ui.selectable_value(&mut tone_map, ToneMap::None, "none");
        if tone_map != state.now().tone_map {
            state.edit("tone map", |c| c.tone_map = tone_map);
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.label("pixels");
        let now = state.now().resolution;
        let mut next = now;
        for (share, label) in [(1.0, "1:1"), (0.5, "1:2"), (0.25, "1:4")] {
            ui.selectable_value(&mut next, Resolution::Window(share), label);
        }
        let fixed = matches!(now, Resolution::Fixed(_));
        if ui.selectable_label(fixed, "fixed").clicked() && !fixed {
            let told = seen.feed.told.image.as_ref();
            next = Resolution::Fixed(told.map_or([640, 480], |t| [t.width(), t.height()]));
        }
        if let Resolution::Fixed(size) = &mut next {
            for n in size {
                ui.add(DragValue::new(n).range(1..=8192));
            }
        }
        if next != now {
            state.edit("pixels", |c| c.resolution = next);
        }
    });
    if let Some(image) = &seen.feed.told.image {
        let frames = seen.feed.told.frames[0];
        ui.label(RichText::new(format!("{} × {}, frame {frames}", image.width(), image.height())).weak());
    }
}

/// What can be written to files.
pub fn save(ui: &mut Ui, state: &mut PanelState) {
    let buttons = [
        ("picture", Save::Png, "what is seen, as PNG"),
        ("EXR", Save::Exr, "the image in linear light, 32-bit floats"),
        ("parameters", Save::Variant, "a variant of the graph, beside it, with the values set as defaults"),
        ("all", Save::Choice, "graph, scene, parameters, camera and what was moved: for --restore"),
    ];
    ui.horizontal_wrapped(|ui| {
        for (label, request, about) in buttons {
            let button = ui.button(label).on_hover_text(about);
            if button.clicked() {
                state.requests.push(request);
            }
            state.mark(format!("save {label}"), button.rect);
        }
    });
}
