//! Parameters drawn at random inside their declared ranges. What fails shrinks to the least that still does.
//!
//! Whole numbers mostly say how much work there is, and their ranges reach far beyond what a test can afford. So two
//! things are bounded, each over the small settings: the product of what the numbers grow by, since nobody knows what a
//! shader does with one, and the work that the plan says it does, since a length may count squared or cubed. What is
//! cut for it is said.

use super::case::Cases;
use super::dice::Dice;
use super::report::{CaseRow, RunSelection};
use super::run::StressGraph;
use glam::{UVec2, UVec3, UVec4, Vec2, Vec3, Vec4};
use lightgraph::internals::graph::ast::Param;
use lightgraph::internals::graph::expr::Val;
use lightgraph::internals::image::file::write_atomically;
use lightgraph::internals::plan::build::Planned;
use lightgraph::internals::session::plan_for;
use lightgraph::internals::value::{Type, Value, Values};
use lightgraph::{Checked, Diagnostic, Gpu, Project, Scene, Session, Settings};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Memory that one plan may take.
const MOST_BYTES: u64 = 512 << 20;
/// Runs to shrink a failure.
const SHRINKS: usize = 60;

/// Draws for one graph.
pub(super) struct Drawer<'a> {
    gpu: &'a Gpu,
    graph: &'a StressGraph,
    scene: Arc<Scene>,
    size: [u32; 2],
    growth: f64,
    /// Work that one plan may do.
    work: u64,
    /// Parameters that are no larger than these.
    most: Values,
    /// All parameters at their small settings.
    base: Values,
    /// Where the scene was written, for whoever runs a failure again.
    file: PathBuf,
    dice: Dice,
    last: Option<Session>,
}

/// Why parameters are no good.
enum Outcome {
    Fine,
    /// The planner, or a check of the graph's own shaders, says why it can't be done.
    Refused(String),
    Broken(String),
}

impl<'a> Drawer<'a> {
    /// Writes the scene into `folder`.
    ///
    /// # Errors
    /// The scene can't be made or written; the small settings are no good.
    pub fn new(gpu: &'a Gpu, cases: &Cases, graph: &'a StressGraph, seed: u64, folder: &Path) -> Checked<Drawer<'a>> {
        let (bytes, description) = cases.random.scene.bytes(&Default::default())?;
        let file = folder.join("random.glb");
        write_atomically(&file, &bytes)?;
        if let Some(text) = description {
            write_atomically(&folder.join("random.ron"), text.as_bytes())?;
        }
        let mut base: Values = graph.project.graph.params.iter().map(|(n, p)| (n.value.clone(), p.default)).collect();
        base.extend(graph.project.params(&graph.texts(&cases.settings))?);
        let mut drawer = Drawer {
            gpu,
            graph,
            scene: Arc::new(Scene::load(&file)?.scene),
            size: [cases.random.size.0, cases.random.size.1],
            growth: cases.random.growth,
            work: 0,
            most: graph.project.params(&graph.texts(&cases.random.most))?,
            base,
            file,
            dice: Dice::new(seed, &graph.name),
            last: None,
        };
        let work = drawer.planned(&drawer.base)?.plan.work();
        drawer.work = (work as f64 * cases.random.work) as u64;
        Ok(drawer)
    }

    /// Every parameter at either end of its range, as far as there is room, the others at their small settings. Of one
    /// that a graph before this one has just so, one end, the graphs in turn.
    pub fn ends(
        &mut self,
        before: &[&StressGraph],
        wanted: RunSelection<'_>,
        stop: &mut dyn FnMut() -> bool,
    ) -> Vec<CaseRow> {
        let mut rows = vec![];
        let params: Vec<(String, Param)> =
            self.graph.project.graph.params.iter().map(|(n, p)| (n.value.clone(), p.clone())).collect();
        for (name, param) in &params {
            let same = |g: &&&StressGraph| {
                let mut theirs = g.project.graph.params.iter();
                theirs.any(|(n, p)| n.value == *name && (p.min, p.max) == (param.min, param.max))
            };
            let ends = match before.iter().filter(same).count() {
                0 => [param.min, param.max],
                n if n % 2 == 1 => [param.min, None],
                _ => [None, param.max],
            };
            for end in ends.into_iter().flatten() {
                let values = self.cut(&[(name, end)]);
                let short = values.get(name) != Some(&end);
                let mut row = self.row("parameters at their ends", &values, wanted, stop);
                if let Some(row) = row.as_mut().filter(|_| short) {
                    row.note(&format!("{name}={} would be too much work", plain(&end)));
                }
                rows.extend(row);
            }
        }
        rows
    }

    /// One vector of parameters.
    pub fn draw(&mut self, wanted: RunSelection<'_>, stop: &mut dyn FnMut() -> bool) -> Option<CaseRow> {
        let params = &self.graph.project.graph.params;
        let mut order: Vec<usize> = (0..params.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, self.dice.below(i + 1));
        }
        let mut drawn = vec![];
        for i in order {
            let (name, param) = &params[i];
            let base = self.base.get(&name.value).copied().unwrap_or(param.default);
            drawn.push((&name.value, draw(param, base, &mut self.dice)));
        }
        let values = self.cut(&drawn);
        self.row("random parameters", &values, wanted, stop)
    }

    /// The small settings with these in their places, each cut by what those before it leave of the room.
    fn cut(&self, drawn: &[(&String, Value)]) -> Values {
        let mut room = self.growth;
        loop {
            let mut values = self.base.clone();
            let mut left = room;
            for (name, drawn) in drawn {
                let Some(base) = self.base.get(*name).copied() else { continue };
                let value = within(base, self.most.get(*name).map_or(*drawn, |m| lesser(*drawn, *m)), left);
                left = (left / growth(base, value)).max(1.0);
                values.insert((*name).clone(), value);
            }
            // What can't be planned costs nothing, and why is for its row to say.
            let fits = self.planned(&values).map_or(true, |p| p.plan.work() <= self.work);
            if fits || room <= 1.0 {
                return values;
            }
            room *= 0.7;
        }
    }

    fn planned(&self, values: &Values) -> Checked<Planned> {
        let settings = Settings { params: values.clone(), size: self.size, watch: true, ..Settings::default() };
        plan_for(&self.graph.project, &self.scene, &settings, self.gpu)
    }

    fn row(
        &mut self,
        case: &str,
        values: &Values,
        wanted: RunSelection<'_>,
        stop: &mut dyn FnMut() -> bool,
    ) -> Option<CaseRow> {
        let mut row = CaseRow::new("random", case, &self.graph.name, &self.shown(values));
        if !wanted.has(&row) {
            return None;
        }
        if stop() {
            return Some(row.left());
        }
        let start = Instant::now();
        match self.run(values) {
            Outcome::Fine => {}
            Outcome::Refused(why) => row.note(&format!("refused: {why}")),
            Outcome::Broken(why) => {
                let least = self.shrink(values.clone());
                row.setting = self.shown(&least);
                row.fail(&format!("{why}; again with: {}", self.command(&least)));
            }
        }
        row.seconds = start.elapsed().as_secs_f64();
        Some(row)
    }

    /// What differs from the small settings.
    fn shown(&self, values: &Values) -> String {
        let other = values.iter().filter(|(n, v)| self.base.get(*n) != Some(v));
        other.map(|(n, v)| format!("{n}={}", plain(v))).collect::<Vec<_>>().join(" ")
    }

    /// The command that renders the same.
    fn command(&self, values: &Values) -> String {
        let differs = |n: &str, v: &Value| {
            !self.graph.project.graph.params.iter().any(|(name, p)| name.value == n && p.default == *v)
        };
        let set: Vec<String> =
            values.iter().filter(|(n, v)| differs(n, v)).map(|(n, v)| format!(" --set {n}={}", plain(v))).collect();
        format!(
            "lightgraph render {} --scene {} --size {}x{}{} --watch-numerics --out random.exr",
            self.graph.path.display(),
            self.file.display(),
            self.size[0],
            self.size[1],
            set.concat()
        )
    }

    fn run(&mut self, values: &Values) -> Outcome {
        match self.planned(values) {
            Err(faults) => return Outcome::Refused(faults.one_line()),
            Ok(planned) if planned.plan.bytes().0 > MOST_BYTES => {
                return Outcome::Refused(format!("it takes {} MiB", planned.plan.bytes().0 >> 20));
            }
            Ok(_) => {}
        }
        let line = |d: &Diagnostic| format!("{} ({})", d.message, d.help.join("; "));
        match self.frame(values) {
            Ok((numbers, told)) => match (numbers.first(), told.first()) {
                (Some(d), _) => Outcome::Broken(line(d)),
                (None, Some(d)) => Outcome::Refused(line(d)),
                (None, None) => Outcome::Fine,
            },
            Err(faults) => Outcome::Broken(faults.one_line()),
        }
    }

    /// Numbers that are none; and all that the graph says is wrong, by checks of its shaders too.
    fn frame(&mut self, values: &Values) -> Checked<(Vec<Diagnostic>, Vec<Diagnostic>)> {
        let settings = Settings { params: values.clone(), size: self.size, watch: true, ..Settings::default() };
        let previous = self.last.take().filter(|s| s.plan.resources.iter().all(|r| !r.history));
        let project = &self.graph.project;
        let mut session = Session::after(self.gpu, project, self.scene.clone(), settings, previous.as_ref())?;
        let report = session.frame(self.gpu, 0, 0.0)?;
        let numbers = report.numerics.as_ref().map_or(vec![], |n| n.faults(&session.plan));
        let told = session.failed_checks(&report);
        self.last = Some(session);
        Ok((numbers, told))
    }

    /// The least change of the small settings that still fails: parameters go back to them one by one, as far as they
    /// can.
    fn shrink(&mut self, mut values: Values) -> Values {
        let mut runs = 0;
        let names: Vec<String> = values.keys().cloned().collect();
        let mut again = true;
        while again && runs < SHRINKS {
            again = false;
            for name in &names {
                let (Some(now), Some(base)) = (values.get(name).copied(), self.base.get(name).copied()) else {
                    continue;
                };
                for to in ways(base, now) {
                    let mut fewer = values.clone();
                    fewer.insert(name.clone(), to);
                    runs += 1;
                    if runs < SHRINKS && matches!(self.run(&fewer), Outcome::Broken(_)) {
                        values = fewer;
                        again = true;
                        break;
                    }
                }
            }
        }
        values
    }
}

/// One parameter elsewhere than at the start, and hardly more work for it.
pub(super) fn near(project: &Project, start: &Values, dice: &mut Dice) -> Values {
    let params = &project.graph.params;
    let mut values = start.clone();
    if params.is_empty() {
        return values;
    }
    let (name, param) = &params[dice.below(params.len())];
    let base = start.get(&name.value).copied().unwrap_or(param.default);
    values.insert(name.value.clone(), within(base, draw(param, base, dice), 2.0));
    values
}

/// Where to go from `now` towards `base`: all of the way, a half, a quarter and so on.
fn ways(base: Value, now: Value) -> Vec<Value> {
    let mut ways = vec![];
    let mut next = (base != now).then_some(base);
    while let Some(to) = next {
        ways.push(to);
        next = half(to, now);
    }
    ways
}

/// A value between both, as whole numbers allow; `None` when there is none.
fn half(a: Value, b: Value) -> Option<Value> {
    let (x, y) = (parts(a), parts(b));
    let middle: Vec<f64> = x.iter().zip(&y).map(|(x, y)| f64::midpoint(*x, *y)).collect();
    let value = of_parts(b.ty(), &middle)?;
    (value != a && value != b && !matches!(b.ty(), Type::Bool | Type::Float)).then_some(value)
}

/// As the command line writes it.
fn plain(v: &Value) -> String {
    parts(*v).iter().map(|x| format!("{x}")).collect::<Vec<_>>().join(",").replace("NaN", "nan")
}

fn parts(v: Value) -> Vec<f64> {
    match Val::from(v) {
        Val::Bool(b) => vec![f64::from(u8::from(b))],
        Val::Int(i) => vec![i as f64],
        Val::Float(f) => vec![f],
        Val::Ints(v) => v.into_iter().map(|i| i as f64).collect(),
        Val::Floats(v) => v,
    }
}

/// The value of a type with these components; whole numbers are rounded.
fn of_parts(ty: Type, p: &[f64]) -> Option<Value> {
    let whole = |i: usize| p.get(i).map_or(0, |x| x.round().clamp(0.0, f64::from(u32::MAX)) as u32);
    let real = |i: usize| p.get(i).map_or(0.0, |x| *x as f32);
    Some(match ty {
        Type::Bool => Value::Bool(whole(0) > 0),
        Type::Uint => Value::Uint(whole(0)),
        Type::Int => Value::Int(p.first()?.round() as i32),
        Type::Float => Value::Float(real(0)),
        Type::UVec2 => Value::UVec2(UVec2::new(whole(0), whole(1))),
        Type::UVec3 => Value::UVec3(UVec3::new(whole(0), whole(1), whole(2))),
        Type::UVec4 => Value::UVec4(UVec4::new(whole(0), whole(1), whole(2), whole(3))),
        Type::Vec2 => Value::Vec2(Vec2::new(real(0), real(1))),
        Type::Vec3 => Value::Vec3(Vec3::new(real(0), real(1), real(2))),
        Type::Vec4 => Value::Vec4(Vec4::new(real(0), real(1), real(2), real(3))),
        Type::Mat4 => return None,
    })
}

/// The ends from which to draw: the declared ones, or a range round the default where there are none.
fn ends(param: &Param, i: usize) -> (f64, f64) {
    let at = |v: &Value| parts(*v).get(i).copied();
    let default = at(&param.default).unwrap_or(0.0);
    let low = param.min.as_ref().and_then(at).unwrap_or(if default >= 0.0 { 0.0 } else { default * 4.0 });
    let high = param.max.as_ref().and_then(at).unwrap_or(default.abs().max(1.0) * 4.0);
    (low, high)
}

/// Whole numbers evenly in their magnitude; others evenly, by their magnitude, or at an end.
fn draw(param: &Param, base: Value, dice: &mut Dice) -> Value {
    let count = parts(base).len();
    let components: Vec<f64> = (0..count)
        .map(|i| {
            let (low, high) = ends(param, i);
            let by_magnitude = |dice: &mut Dice| low + (dice.unit() * (1.0 + (high - low) * 1e3).ln()).exp_m1() / 1e3;
            match param.ty {
                Type::Bool => f64::from(u8::from(dice.unit() < 0.5)),
                Type::Uint | Type::Int | Type::UVec2 | Type::UVec3 | Type::UVec4 => {
                    (dice.unit() * (2.0 + high - low).ln()).exp_m1().floor().min(high - low) + low
                }
                _ => match dice.below(6) {
                    0 => low,
                    1 => high,
                    2 | 3 => by_magnitude(dice).clamp(low, high),
                    _ => dice.between(low, high),
                },
            }
        })
        .collect();
    of_parts(param.ty, &components).unwrap_or(base)
}

/// The lesser of two values, component by component.
fn lesser(a: Value, b: Value) -> Value {
    let least: Vec<f64> = parts(a).iter().zip(parts(b)).map(|(a, b)| a.min(b)).collect();
    of_parts(a.ty(), &least).unwrap_or(a)
}

/// How many times larger the whole numbers of a value are than those of another.
fn growth(base: Value, v: Value) -> f64 {
    match v.ty() {
        Type::Uint | Type::Int | Type::UVec2 | Type::UVec3 | Type::UVec4 => {
            parts(v).iter().zip(parts(base)).map(|(v, b)| (v / b.max(1.0)).max(1.0)).product()
        }
        _ => 1.0,
    }
}

/// A value, cut so that it is at most `room` times larger than another.
fn within(base: Value, v: Value, room: f64) -> Value {
    let mut cut = parts(v);
    for _ in 0..256 {
        let now = of_parts(v.ty(), &cut).unwrap_or(base);
        if growth(base, now) <= room {
            return now;
        }
        let factors: Vec<f64> = cut.iter().zip(parts(base)).map(|(c, b)| c / b.max(1.0)).collect();
        let largest = factors.iter().copied().fold(1.0, f64::max);
        for (c, f) in cut.iter_mut().zip(factors) {
            if f == largest {
                *c = (*c * 0.7).floor();
                break;
            }
        }
    }
    base
}

#[cfg(test)]
mod tests {
    use super::*;
    use lightgraph::internals::diag::{Source, Span};

    fn param(ty: Type, default: Value, min: Value, max: Value) -> Param {
        let span = Span::whole(&Source::new("test", ""));
        Param { ty, default, min: Some(min), max: Some(max), about: String::new(), span }
    }

    #[test]
    fn what_is_drawn_lies_in_its_range_and_reaches_both_ends() {
        let p = param(Type::Uint, Value::Uint(4), Value::Uint(2), Value::Uint(256));
        let f = param(Type::Float, Value::Float(0.5), Value::Float(0.0), Value::Float(16.0));
        let mut dice = Dice::new(1, "test");
        let (mut low, mut high) = (false, false);
        for _ in 0..2000 {
            let v = draw(&p, Value::Uint(4), &mut dice);
            assert!(p.accepts(&v).is_ok(), "{v}");
            low |= v == Value::Uint(2);
            high |= matches!(v, Value::Uint(200..));
            assert!(f.accepts(&draw(&f, Value::Float(0.5), &mut dice)).is_ok());
        }
        assert!(low && high);
    }

    #[test]
    fn growth_is_bounded_over_all_components() {
        let base = Value::UVec3(UVec3::splat(2));
        let v = within(base, Value::UVec3(UVec3::new(64, 1, 64)), 64.0);
        assert!(growth(base, v) <= 64.0 && growth(base, v) > 16.0, "{v}");
        assert_eq!(within(base, Value::UVec3(UVec3::new(64, 1, 1)), 64.0), Value::UVec3(UVec3::new(64, 1, 1)));
    }

    #[test]
    fn the_same_seed_draws_the_same_and_another_name_something_else() {
        let sequence = |seed, name| {
            let mut dice = Dice::new(seed, name);
            [dice.word(), dice.word(), dice.word()]
        };
        assert_eq!(sequence(3, "a"), sequence(3, "a"));
        assert_ne!(sequence(3, "a"), sequence(3, "b"));
        assert_ne!(sequence(3, "a"), sequence(4, "a"));
    }
}
