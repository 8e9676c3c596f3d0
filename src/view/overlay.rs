//! Faults over the image: all of them, with their places, until they are mended.

use super::feed::Told;
use super::state::State;
use crate::diag::{Diagnostic, render};
use egui::{Align2, Color32, Frame, RichText, ScrollArea, Vec2};

const RED: Color32 = Color32::from_rgb(0xe5, 0x48, 0x4d);

/// Shows the faults of what was wished for, over the last good image.
pub fn show(ui: &egui::Ui, state: &mut State, told: &Told, image: egui::Rect) {
    if told.faults.is_empty() {
        state.marks.remove("faults");
        return;
    }
    let area = egui::Area::new(egui::Id::unique("faults"))
        .order(egui::Order::Middle)
        .pivot(Align2::LEFT_BOTTOM)
        .fixed_pos(image.left_bottom() + Vec2::new(12.0, -12.0));
    let shown = area.show(ui.ctx(), |ui| {
        let frame = Frame::popup(ui.style()).fill(Color32::from_rgba_unmultiplied(24, 14, 16, 240)).stroke((1.0, RED));
        frame.show(ui, |ui| {
            let width = (image.width() - 48.0).max(40.0);
            ui.set_max_width(width);
            ui.label(RichText::new(title(&told.faults, told.image.is_some())).color(RED).strong());
            let height = (image.height() - 90.0).max(30.0);
            ScrollArea::both().max_height(height).max_width(width).show(ui, |ui| {
                let text = RichText::new(text(&told.faults)).monospace().color(Color32::from_gray(225));
                ui.add(egui::Label::new(text).extend().selectable(true));
            });
        });
    });
    state.mark("faults", shown.response.rect);
}

fn title(faults: &[Diagnostic], image: bool) -> String {
    let count = if faults.len() == 1 { "1 fault".to_string() } else { format!("{} faults", faults.len()) };
    if image { format!("{count}; the last good frame goes on") } else { count }
}

/// The faults as a terminal shows them, without the empty lines at the end.
fn text(faults: &[Diagnostic]) -> String {
    render(faults).trim_end().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::{Source, Span};

    #[test]
    fn a_fault_stands_with_its_file_line_column_and_caret() {
        let source = Source::new("a/b.wgsl", "fn main() {\n    let x = y;\n}\n");
        let d = Diagnostic::error("no definition of `y`").at(&Span::new(&source, 24..25), "");
        let text = text(&[d]);
        assert!(text.contains("a/b.wgsl:2:13"), "{text}");
        let lines: Vec<&str> = text.lines().collect();
        let line = lines.iter().position(|l| l.contains("let x = y;")).expect("the line is quoted");
        assert_eq!(lines[line + 1].find('^'), lines[line].find("y;"), "{text}");
    }

    #[test]
    fn the_title_counts() {
        let fault = Diagnostic::error("x");
        assert_eq!(title(&[fault.clone()], false), "1 fault");
        assert_eq!(title(&[fault.clone(), fault], true), "2 faults; the last good frame goes on");
    }
}
