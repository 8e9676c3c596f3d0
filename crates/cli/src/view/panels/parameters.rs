//! The graph's parameters, each by the widget that its type and range ask for.

use super::PanelContext;
use crate::view::state::PanelState;
use egui::{DragValue, Rect, Slider, Ui, Vec2};
use glam::{UVec2, UVec3, UVec4, Vec3, Vec4};
use lightgraph::internals::graph::ast::Param;
use lightgraph::internals::value::Value;

pub fn show(ui: &mut Ui, state: &mut PanelState, seen: &PanelContext) {
    let Some(subject) = &seen.feed.told.subject else { return };
    for (name, param) in &subject.graph.params {
        let name = name.value.as_str();
        let set = state.now().params.get(name).filter(|v| param.accepts(v).is_ok()).copied();
        let mut value = set.unwrap_or(param.default);
        ui.horizontal(|ui| {
            let label = ui.add_sized([110.0, 18.0], egui::Label::new(name).truncate());
            label.on_hover_text(format!("{}\n{} by default", param.about, param.default));
            let rect = widget(ui, param, &mut value);
            if ui.clip_rect().contains(rect.center()) {
                state.mark(format!("param {name}"), rect);
            }
            if set.is_some() {
                let reset = ui.small_button("×").on_hover_text("back to the graph's default");
                if reset.clicked() {
                    state.edit(name, |c| {
                        c.params.remove(name);
                    });
                    state.choice.rest();
                }
                state.mark(format!("reset {name}"), reset.rect);
            }
        });
        if value != set.unwrap_or(param.default) && param.accepts(&value).is_ok() {
            state.edit(name, |c| {
                c.params.insert(name.to_string(), value);
            });
        }
    }
    if subject.graph.params.is_empty() {
        ui.label("The graph has none.");
    }
}

/// The widget for a parameter; returns the part of it that is dragged.
fn widget(ui: &mut Ui, param: &Param, value: &mut Value) -> Rect {
    let (low, high) = (param.min, param.max);
    match value {
        Value::Bool(v) => ui.checkbox(v, "").rect,
        Value::Uint(v) => {
            let least = if let Some(Value::Uint(m)) = low { m } else { 0 };
            match high {
                Some(Value::Uint(most)) => slider(ui, Slider::new(v, least..=most).logarithmic(most >= 100)),
                _ => ui.add(DragValue::new(v).range(least..=u32::MAX)).rect,
            }
        }
        Value::Int(v) => {
            let least = if let Some(Value::Int(m)) = low { m } else { i32::MIN };
            match high {
                Some(Value::Int(most)) if least > i32::MIN => slider(ui, Slider::new(v, least..=most)),
                Some(Value::Int(most)) => ui.add(DragValue::new(v).range(least..=most)).rect,
                _ => ui.add(DragValue::new(v).range(least..=i32::MAX)).rect,
            }
        }
        Value::Float(v) => match (low, high) {
            (Some(Value::Float(least)), Some(Value::Float(most))) => {
                let usual = if let Value::Float(d) = param.default { d } else { 0.0 };
                let small = least >= 0.0 && usual > 0.0 && most / usual >= 100.0;
                let slider_ = Slider::new(v, least..=most).logarithmic(small).max_decimals(6);
                slider(ui, slider_.smallest_positive(f64::from(usual) * 1e-3))
            }
            _ => {
                let least = if let Some(Value::Float(m)) = low { m } else { f32::MIN };
                let most = if let Some(Value::Float(m)) = high { m } else { f32::MAX };
                let speed = f64::from(v.abs().max(0.01)) * 0.01;
                ui.add(DragValue::new(v).range(least..=most).speed(speed)).rect
            }
        },
        Value::Vec3(v) if low == Some(Value::Vec3(Vec3::ZERO)) && high == Some(Value::Vec3(Vec3::ONE)) => {
            let mut color = v.to_array();
            let button = ui.color_edit_button_rgb(&mut color);
            *v = color.into();
            button.rect
        }
        Value::Vec4(v) if low == Some(Value::Vec4(Vec4::ZERO)) && high == Some(Value::Vec4(Vec4::ONE)) => {
            let mut color = v.to_array();
            let button = ui.color_edit_button_rgba_unmultiplied(&mut color);
            *v = color.into();
            button.rect
        }
        Value::UVec2(v) => {
            let mut parts = v.to_array();
            let rect = integers(ui, &mut parts, param);
            *v = UVec2::from(parts);
            rect
        }
        Value::UVec3(v) => {
            let mut parts = v.to_array();
            let rect = integers(ui, &mut parts, param);
            *v = UVec3::from(parts);
            rect
        }
        Value::UVec4(v) => {
            let mut parts = v.to_array();
            let rect = integers(ui, &mut parts, param);
            *v = UVec4::from(parts);
            rect
        }
        Value::Vec2(v) => {
            let mut parts = v.to_array();
            let rect = floats(ui, &mut parts, param);
            *v = parts.into();
            rect
        }
        Value::Vec3(v) => {
            let mut parts = v.to_array();
            let rect = floats(ui, &mut parts, param);
            *v = parts.into();
            rect
        }
        Value::Vec4(v) => {
            let mut parts = v.to_array();
            let rect = floats(ui, &mut parts, param);
            *v = parts.into();
            rect
        }
        Value::Mat4(_) => ui.label("a matrix").rect,
    }
}

/// A slider; returns its rail.
fn slider(ui: &mut Ui, slider: Slider) -> Rect {
    let rail = ui.spacing().slider_width;
    let rect = ui.add(slider).rect;
    Rect::from_min_size(rect.min, Vec2::new(rail, rect.height()))
}

fn integers(ui: &mut Ui, parts: &mut [u32], param: &Param) -> Rect {
    let bound = |v: Option<Value>, i: usize| match v {
        Some(Value::UVec2(v)) => v.to_array().get(i).copied(),
        Some(Value::UVec3(v)) => v.to_array().get(i).copied(),
        Some(Value::UVec4(v)) => v.to_array().get(i).copied(),
        _ => None,
    };
    let mut rect = Rect::NOTHING;
    for (i, part) in parts.iter_mut().enumerate() {
        let range = bound(param.min, i).unwrap_or(0)..=bound(param.max, i).unwrap_or(u32::MAX);
        rect |= ui.add(DragValue::new(part).range(range).speed(0.1)).rect;
    }
    rect
}

fn floats(ui: &mut Ui, parts: &mut [f32], param: &Param) -> Rect {
    let bound = |v: Option<Value>, i: usize| match v {
        Some(Value::Vec2(v)) => v.to_array().get(i).copied(),
        Some(Value::Vec3(v)) => v.to_array().get(i).copied(),
        Some(Value::Vec4(v)) => v.to_array().get(i).copied(),
        _ => None,
    };
    let mut rect = Rect::NOTHING;
    for (i, part) in parts.iter_mut().enumerate() {
        let range = bound(param.min, i).unwrap_or(f32::MIN)..=bound(param.max, i).unwrap_or(f32::MAX);
        rect |= ui.add(DragValue::new(part).range(range).speed(0.01)).rect;
    }
    rect
}
