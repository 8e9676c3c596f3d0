//! A plan as a picture: one SVG without anything outside it, light or dark as the viewer is.

use super::picture::{Picture, Rect, WireLine, picture};
use lightgraph::internals::plan::Plan;
use lightgraph::internals::plan::text::words::bytes;
use std::collections::BTreeSet;
use std::fmt::Write;

const MARGIN: f32 = 24.0;
/// Height of the picture's heading.
const HEAD: f32 = 44.0;
/// Width of a skipped pass and its reason.
const SKIPPED: f32 = 250.0;

/// Colours of wires (light, dark), by turns, so that a wire can be followed; after Okabe and Ito's palette.
const COLORS: [(&str, &str); 7] = [
    ("#0072b2", "#56b4e9"),
    ("#d55e00", "#f0884a"),
    ("#009e73", "#35c79d"),
    ("#b0578d", "#d98bbb"),
    ("#9a7400", "#e0b43c"),
    ("#5b5fc7", "#9b9ff0"),
    ("#6b7280", "#a3abb8"),
];

/// Passes as boxes in rows by depth with what they write at their feet, a wire from each to its readers, loops as
/// frames, skipped passes in grey below. `↻` marks what an earlier iteration or frame wrote.
pub fn to_svg(plan: &Plan) -> String {
    let laid = picture(plan, &BTreeSet::new());
    let across = (laid.width.max(640.0) / (SKIPPED + 12.0)).max(1.0) as usize;
    let below = plan.skipped.len().div_ceil(across) as f32 * 48.0;
    let (width, height) = (laid.width.max(640.0) + 2.0 * MARGIN, laid.height + below + HEAD + 3.0 * MARGIN);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" height=\"{height:.0}\">\n"
    );
    out += &style();
    let (shared, _) = plan.bytes();
    let about = format!("{} steps, {}", plan.steps.len(), bytes(shared));
    // Writing to a string can't fail, here and below.
    let _ = writeln!(out, "<title>{}</title>", escaped(&plan.graph));
    let _ = writeln!(out, "<rect class=\"page\" width=\"100%\" height=\"100%\"/>");
    text(&mut out, "head", MARGIN, 32.0, &plan.graph);
    text(&mut out, "small", MARGIN + plan.graph.chars().count() as f32 * 9.0 + 16.0, 32.0, &about);
    let _ = writeln!(out, "<g transform=\"translate({MARGIN} {:.0})\">", HEAD + MARGIN / 2.0);
    draw(&laid, &mut out);
    for (i, (pass, why)) in plan.skipped.iter().enumerate() {
        let x = (i % across) as f32 * (SKIPPED + 12.0);
        let y = laid.height + MARGIN + (i / across) as f32 * 48.0;
        let rect = Rect { x, y, width: SKIPPED, height: 40.0 };
        shape(&mut out, "skipped", rect, 6.0);
        text(&mut out, "faint", x + 10.0, y + 17.0, &fitted(pass, 34));
        text(&mut out, "faint small", x + 10.0, y + 32.0, &fitted(why, 35));
    }
    out + "</g>\n</svg>\n"
}

fn style() -> String {
    let mut css = String::from(
        "text{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,'DejaVu Sans Mono',monospace;font-size:11px;fill:#1f2933}
.head{font-size:15px;font-weight:600}.name{font-size:13px;font-weight:600}.small{font-size:11px;fill:#52606d}
.page{fill:#fbfcfd}.box{fill:#fff;stroke:#9aa5b1}.draw,.screen{fill:#e8f1fb}.compute{fill:#e9f7ef}.output{fill:#fff6e0}
.copy,.clear{fill:#f1f3f5}.loop{fill:#00000008;stroke:#7b8794;stroke-dasharray:5 4}
.halo{paint-order:stroke;stroke:#fbfcfd;stroke-width:5px;stroke-linejoin:round}
.port{fill:#fff}.wire{fill:none;stroke-width:1.6px}.skipped{fill:none;stroke:#cbd2d9;stroke-dasharray:3 3}.faint{fill:#9aa5b1}
",
    );
    let mut dark = String::from(
        "text{fill:#e4e7eb}.small{fill:#9aa5b1}.page{fill:#14181d}.box{fill:#1f2730;stroke:#52606d}.draw,.screen{fill:#1c2b3d}
.compute{fill:#1a3028}.output{fill:#3a3018}.copy,.clear{fill:#262b31}.loop{fill:#ffffff08;stroke:#7b8794}
.halo{stroke:#14181d}.port{fill:#14181d}.skipped{stroke:#3e4c59}.faint{fill:#616e7c}
",
    );
    for (i, (light, night)) in COLORS.iter().enumerate() {
        let rule = |color: &str| format!(".w{i}{{stroke:{color}}}.t{i}{{fill:{color}}}");
        css += &rule(light);
        dark += &rule(night);
    }
    format!("<style>{css}\n@media (prefers-color-scheme:dark){{{dark}}}</style>\n")
}

fn draw(laid: &Picture, out: &mut String) {
    for (_, rect) in &laid.loops {
        shape(out, "loop", *rect, 10.0);
    }
    for w in &laid.wires {
        wire(w, out);
    }
    for (title, rect) in &laid.loops {
        text(out, "name halo", rect.x + 12.0, rect.y + 20.0, &format!("loop {title}"));
    }
    for pass in &laid.boxes {
        let rect = pass.rect;
        let corner = if pass.kind == "output" { rect.height / 2.0 } else { 6.0 };
        shape(out, &format!("box {}", pass.kind), rect, corner);
        let middle = rect.x + rect.width / 2.0;
        centred(out, "name", middle, rect.y + 18.0, &pass.name);
        centred(out, "small", middle, rect.y + 34.0, &pass.about);
        if !pass.carried.is_empty() {
            centred(out, "small", middle, rect.y + 49.0, &pass.carried);
        }
        for p in &pass.ports {
            shape(out, &format!("port w{}", p.port % COLORS.len()), p.rect, 4.0);
            centred(out, "", p.rect.x + p.rect.width / 2.0, p.rect.y + 13.0, &p.resource);
        }
    }
}

/// A path that leaves and arrives straight down, and an arrow's head where it ends at a pass.
fn wire(w: &WireLine, out: &mut String) {
    let color = w.port % COLORS.len();
    let [[x, y], rest @ ..] = &w.points[..] else { return };
    let mut path = format!("M{x:.1} {y:.1}");
    let (mut x, mut y) = (*x, *y);
    for [to, down] in rest {
        if (to - x).abs() < 0.05 {
            let _ = write!(path, "V{down:.1}");
        } else {
            let middle = (y + down) / 2.0;
            let _ = write!(path, "C{x:.1} {middle:.1} {to:.1} {middle:.1} {to:.1} {down:.1}");
        }
        (x, y) = (*to, *down);
    }
    let _ = writeln!(out, "<path class=\"wire w{color}\" d=\"{path}\"/>");
    if w.arrow {
        let (a, b, top) = (x - 4.0, x + 4.0, y - 7.0);
        let _ = writeln!(out, "<path class=\"t{color}\" d=\"M{x:.1} {y:.1}L{a:.1} {top:.1}H{b:.1}Z\"/>");
    }
}

fn shape(out: &mut String, class: &str, r: Rect, corner: f32) {
    let Rect { x, y, width, height } = r;
    let _ = writeln!(
        out,
        "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" rx=\"{corner:.1}\"/>"
    );
}

fn text(out: &mut String, class: &str, x: f32, y: f32, text: &str) {
    let _ = writeln!(out, "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", escaped(text));
}

fn centred(out: &mut String, class: &str, x: f32, y: f32, text: &str) {
    let text = escaped(text);
    let _ = writeln!(out, "<text class=\"{class}\" text-anchor=\"middle\" x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>");
}

/// At most `most` characters, the rest as `…`.
fn fitted(text: &str, most: usize) -> String {
    if text.chars().count() <= most { text.to_string() } else { text.chars().take(most - 1).chain(['…']).collect() }
}

/// Text that XML takes as text: marks replaced, control characters left out.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
