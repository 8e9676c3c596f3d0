//! Names resources, sizes and steps in words.

use crate::plan::expand::shape;
use crate::plan::{
    Action, Binding, Comparison, Cull, Desc, Draw, DrawGeometry, DrawMember, Ending, Loop, Place, Plan, ResourceId,
    Step, StepId,
};
use crate::shader::{BindingKind, Def, Shader};
use std::collections::BTreeSet;

/// A step as a line of words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StepWords {
    pub name: String,
    pub kind: &'static str,
    /// Empty without one.
    pub shader: String,
    /// Workgroups, targets, clear values; may be empty.
    pub detail: String,
    pub reads: Vec<String>,
    pub writes: Vec<String>,
}

impl StepWords {
    /// The row of a step.
    pub fn of(plan: &Plan, step: StepId) -> StepWords {
        let s = &plan.steps[step.0];
        let (kind, shader, detail) = match &s.action {
            Action::Draw(d) => {
                let kind = if d.geometry == DrawGeometry::Screen { "screen" } else { "draw" };
                (kind, shader_name(plan, d.shader), drawing(plan, d))
            }
            Action::Compute { shader, groups: [x, y, z], instances, indirect, .. } => {
                let groups = match (instances, indirect) {
                    (Some(instances), _) => format!("{instances} instances of {x}×{y}"),
                    (None, Some(_)) => format!("at most {x}×{y}×{z}"),
                    (None, None) => format!("{x}×{y}×{z}"),
                };
                ("compute", shader_name(plan, *shader), format!("{groups} groups"))
            }
            Action::Copy { .. } => ("copy", String::new(), String::new()),
            Action::Clear { value, .. } => ("clear", String::new(), format!("to {}", color(value))),
        };
        let names = |ids: &[ResourceId]| -> Vec<String> {
            let mut names: Vec<String> = vec![];
            for id in ids {
                let name = &plan.resources[id.0].name;
                if !names.contains(name) {
                    names.push(name.clone());
                }
            }
            names
        };
        let detail = [detail, mips(plan, s), s.frames.words().unwrap_or_default().into()]
            .into_iter()
            .filter(|words| !words.is_empty())
            .collect::<Vec<_>>()
            .join(", ");
        StepWords { name: s.name.clone(), kind, shader, detail, reads: names(&s.reads), writes: names(&s.writes) }
    }

    /// The row with one text for another in all names.
    pub fn renamed(&self, from: &str, to: &str) -> StepWords {
        let all = |names: &[String]| names.iter().map(|n| n.replace(from, to)).collect();
        StepWords {
            name: self.name.replace(from, to),
            reads: all(&self.reads),
            writes: all(&self.writes),
            ..self.clone()
        }
    }

    /// What flows: `a, b → c`.
    pub fn flow(&self) -> String {
        let reads = self.reads.join(", ");
        let arrow = if reads.is_empty() { "→ " } else { " → " };
        format!("{reads}{arrow}{}", self.writes.join(", "))
    }
}

/// The levels that a step reads and writes, where it names them.
fn mips(plan: &Plan, step: &Step) -> String {
    let (mut from, mut to) = (BTreeSet::new(), BTreeSet::new());
    let variables = step.action.shader().map_or(&[][..], |i| &plan.shaders[i].interface.variables);
    for (binding, variable) in step.bindings.iter().zip(variables) {
        if let Binding::Level(_, mip) = binding {
            let stored = matches!(variable.kind, BindingKind::StorageTexture { .. });
            if stored { &mut to } else { &mut from }.insert(*mip);
        }
    }
    if let Action::Draw(draw) = &step.action {
        let several = |id: ResourceId| matches!(&plan.resources[id.0].desc, Desc::Texture(t) if t.mips > 1);
        to.extend(draw.color.iter().filter(|c| several(c.resource)).map(|c| c.mip));
    }
    let list = |mips: BTreeSet<u32>| mips.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    match (from.is_empty(), to.is_empty()) {
        (true, true) => String::new(),
        (false, true) => format!("mip {}", list(from)),
        (true, false) => format!("to mip {}", list(to)),
        (false, false) => format!("mip {} to {}", list(from), list(to)),
    }
}

/// The path of a shader; with its number where the plan has it in several forms.
fn shader_name(plan: &Plan, index: usize) -> String {
    let path = &plan.shaders[index].path;
    let twins: Vec<usize> = (0..plan.shaders.len()).filter(|i| plan.shaders[*i].path == *path).collect();
    match twins.iter().position(|i| *i == index) {
        Some(n) if twins.len() > 1 => format!("{path}#{n}"),
        _ => path.clone(),
    }
}

/// All shaders by the names that rows use, each with its definitions.
pub fn shaders(plan: &Plan) -> Vec<(String, String)> {
    (0..plan.shaders.len()).map(|i| (shader_name(plan, i), definitions(&plan.shaders[i]))).collect()
}

fn definitions(shader: &Shader) -> String {
    let word = |(name, def): (&String, &Def)| match def {
        Def::Bool(v) => format!("{name}={v}"),
        Def::Int(v) => format!("{name}={v}"),
        Def::Uint(v) => format!("{name}={v}u"),
    };
    shader.defs.iter().map(word).collect::<Vec<_>>().join(" ")
}

fn drawing(plan: &Plan, d: &Draw) -> String {
    let mut words = places(&d.members);
    if d.views > 1 {
        words = vec![format!("{} draws of {} views", d.members.len(), d.views)];
    }
    let name = |id: ResourceId| plan.resources[id.0].name.as_str();
    for c in &d.color {
        match c.clear {
            None => words.push(format!("keeps {}", name(c.resource))),
            Some(value) if value != [0.0; 4] => words.push(format!("clears {} to {}", name(c.resource), color(&value))),
            Some(_) => {}
        }
        if let Some(to) = c.resolve {
            words.push(format!("resolves {} to {}", name(c.resource), name(to)));
        }
    }
    if let Some(depth) = &d.depth {
        match depth.clear {
            None => words.push(format!("keeps {}", name(depth.resource))),
            Some(value) if value != 1.0 => words.push(format!("clears {} to {value}", name(depth.resource))),
            Some(_) => {}
        }
        if depth.compare != wgpu_types::CompareFunction::Less {
            words.push(format!("depth {:?}", depth.compare));
        }
        if !depth.write {
            words.push("depth only tested".into());
        }
    }
    let blended: Vec<&str> = d.color.iter().filter(|c| c.blend.is_some()).map(|c| name(c.resource)).collect();
    match blended.len() {
        0 => {}
        n if n == d.color.len() => words.push("blends".into()),
        _ => words.push(format!("blends {}", blended.join(", "))),
    }
    if let Some(level) = d.level.and_then(|i| plan.levels.get(i)) {
        let all = plan.value("triangles").map_or(String::new(), |n| format!(" of {n}"));
        let within = if level.tolerance > 0.0 { format!(", within {} m", level.tolerance) } else { String::new() };
        words.push(format!("{}{all} triangles{within}", level.triangles));
    }
    match d.geometry {
        DrawGeometry::Scene { cull: Cull::Material } | DrawGeometry::Screen => {}
        DrawGeometry::Scene { cull } => words.push(format!("cull {cull:?}")),
        DrawGeometry::Vertices { count, instances, cull, indirect, .. } => {
            let most = if indirect.is_some() { "at most " } else { "" };
            words.push(format!("{most}{instances} × {count} vertices"));
            if cull != Cull::None {
                words.push(format!("cull {cull:?}"));
            }
        }
    }
    words.join(", ")
}

fn places(members: &[DrawMember]) -> Vec<String> {
    let n = members.len();
    let many = |noun: &str| if n == 1 { format!("1 {noun}") } else { format!("{n} {noun}s") };
    match members.first().map(|m| m.place) {
        Some(Place::Rect(_)) => vec![many("tile")],
        Some(Place::Layer(first)) if n == 1 => vec![format!("layer {first}")],
        Some(Place::Layer(_)) => vec![many("layer")],
        Some(Place::LoopLayer(0)) => vec!["layer of the loop's index".into()],
        Some(Place::LoopLayer(plus)) => vec![format!("layer of the loop's index + {plus}")],
        Some(Place::Whole) if n > 1 => vec![format!("{n} draws")],
        Some(Place::Whole) | None => vec![],
    }
}

/// `(r, g, b, a)`
pub fn color(c: &[f64; 4]) -> String {
    format!("({}, {}, {}, {})", c[0], c[1], c[2], c[3])
}

/// Format, extent, layers, tiles, mips.
pub fn description(desc: &Desc) -> String {
    match desc {
        Desc::Buffer { .. } => "buffer".into(),
        Desc::Texture(_) => shape(desc),
    }
}

/// `bounce × 2 until change < 0.002`
pub fn loop_head(plan: &Plan, l: &Loop) -> String {
    let until = l.until.as_ref().map(|u| {
        let sign = comparison(u.comparison);
        let ending = match &u.ending {
            Ending::Device => String::new(),
            Ending::Host { why } => format!(", ended by the host: {why}"),
        };
        format!(" until {} {sign} {}{ending}", plan.resources[u.buffer.0].name, u.value)
    });
    format!("{} × {}{}", l.name, l.count, until.unwrap_or_default())
}

/// The sign of a comparison.
pub fn comparison(c: Comparison) -> &'static str {
    match c {
        Comparison::Less => "<",
        Comparison::LessEqual => "<=",
        Comparison::Greater => ">",
        Comparison::GreaterEqual => ">=",
    }
}

/// Bytes with a binary unit, three digits or more.
pub fn bytes(n: u64) -> String {
    let mut value = n as f64;
    for unit in ["B", "KiB", "MiB"] {
        if value < 1024.0 {
            return if unit == "B" { format!("{n} B") } else { format!("{value:.1} {unit}") };
        }
        value /= 1024.0;
    }
    format!("{value:.2} GiB")
}

/// The first `[n]` in a name: its number, and the text itself.
pub fn member(name: &str) -> Option<(u32, &str)> {
    let open = name.find('[')?;
    let close = open + name[open..].find(']')?;
    Some((name[open + 1..close].parse().ok()?, &name[open..=close]))
}

/// A name with `[i]` for its member.
pub fn template(name: &str) -> String {
    member(name).map_or_else(|| name.to_string(), |(_, text)| name.replacen(text, "[i]", 1))
}

/// Whether the plan made a resource itself, between the stages of a reduction. No name in a graph has a dot.
pub fn intermediate(name: &str) -> bool {
    name.contains('.')
}

/// Numbers in rising order, runs drawn together: `1, 4…9`.
pub fn ranges(numbers: impl IntoIterator<Item = usize>) -> String {
    let mut runs: Vec<(usize, usize)> = vec![];
    for n in numbers {
        match runs.last_mut() {
            Some((_, last)) if n == *last + 1 => *last = n,
            _ => runs.push((n, n)),
        }
    }
    let word = |(a, b): (usize, usize)| if a == b { a.to_string() } else { format!("{a}…{b}") };
    runs.into_iter().map(word).collect::<Vec<_>>().join(", ")
}
