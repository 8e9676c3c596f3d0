//! Faults over the image, or the checks in shaders that do not hold in it: all of them, with their places, until they
//! are mended.

use super::feed::ViewState;
use super::state::PanelState;
use egui::{Color32, Pos2, Rect, RichText, ScrollArea, StrokeKind, TextStyle, UiBuilder};
use lightgraph::Diagnostic;
use lightgraph::internals::diag::render;

/// Round the faults, in points.
const MARGIN: f32 = 12.0;
/// Of faults: what is shown is not what was wished for.
const RED: Color32 = Color32::from_rgb(0xe5, 0x48, 0x4d);
/// Of checks: it is, and says itself that it is wrong.
const AMBER: Color32 = Color32::from_rgb(0xf5, 0xa6, 0x23);

/// Shows the faults of what was wished for, over the last good image; without any, what its shaders say of themselves.
pub fn show(ui: &mut egui::Ui, state: &mut PanelState, told: &ViewState, image: Rect) {
    let (list, title, color) = match (told.faults.is_empty(), told.checks.is_empty()) {
        (false, _) => (&told.faults, title(&told.faults, told.image.is_some()), RED),
        (true, false) => (&told.checks, "shaders report of this frame".to_string(), AMBER),
        (true, true) => return,
    };
    if !image.shrink(MARGIN).is_positive() {
        return;
    }
    let text = text(list);
    let row = ui.text_style_height(&TextStyle::Monospace);
    // The title, the lines, a bar to scroll by, the frame.
    let wanted = (text.lines().count() as f32 + 1.0) * row + 52.0;
    let room = image.shrink(MARGIN);
    let rect = Rect::from_min_max(Pos2::new(room.left(), (room.bottom() - wanted).max(room.top())), room.max);
    ui.painter().rect(rect, 6.0, Color32::from_rgba_unmultiplied(24, 14, 16, 242), (1.0, color), StrokeKind::Inside);
    let mut inner = ui.new_child(UiBuilder::new().max_rect(rect.shrink(10.0)).id_salt("faults"));
    inner.label(RichText::new(title).color(color).strong());
    ScrollArea::both().auto_shrink([false, false]).show(&mut inner, |ui| {
        let text = RichText::new(text).monospace().color(Color32::from_gray(225));
        ui.add(egui::Label::new(text).extend().selectable(true));
    });
    state.mark("faults", rect);
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
    use lightgraph::internals::diag::{Source, Span};

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
        assert_eq!(title(std::slice::from_ref(&fault), false), "1 fault");
        assert_eq!(title(&[fault.clone(), fault], true), "2 faults; the last good frame goes on");
    }
}
