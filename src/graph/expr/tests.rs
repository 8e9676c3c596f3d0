//! Expressions against answers by hand, and random ones against an evaluator that shares nothing with the one tested: it
//! works on trees that never were text, in 128 bits.

use super::parse::{DEPTH, OPERATORS};
use super::*;
use crate::diag::Source;
use proptest::prelude::*;

fn names(name: &str) -> Option<Val> {
    Some(match name {
        "n" => Val::Int(5),
        "grid" => Val::Ints(vec![2, 3, 4]),
        "eps" => Val::Float(0.5),
        "at" => Val::Floats(vec![0.25, -1.0]),
        "on" => Val::Bool(true),
        _ => return None,
    })
}

fn eval(text: &str) -> Result<Val, Diagnostic> {
    Expr::parse(&Span::whole(&Source::new("e", text)), text)?.eval(&names)
}

fn says(text: &str, words: &str) {
    let d = eval(text).expect_err(text);
    let all = format!("{} {}", d.message, d.help.join(" "));
    assert!(all.contains(words), "{text}: {all}");
}

#[test]
fn arithmetic_binds_as_usual() {
    assert_eq!(eval("1 + n * 2 - 3"), Ok(Val::Int(8)));
    assert_eq!(eval("grid.x * grid.y * grid.z"), Ok(Val::Int(24)));
    assert_eq!(eval("(n + 1) / 4"), Ok(Val::Int(1)));
    assert_eq!(eval("ceil_div(n, 4) + max(1, log2(9))"), Ok(Val::Int(5)));
    assert_eq!(eval("ceil_div(grid, 2)"), Ok(Val::Ints(vec![1, 2, 2])));
    assert_eq!(eval("n > 4 && !(eps >= 1) ? 7 : 8"), Ok(Val::Int(7)));
    assert_eq!(eval("-2 - -3"), Ok(Val::Int(1)));
    assert_eq!(eval("1e-3 * 2"), Ok(Val::Float(0.002)));
    assert_eq!(eval("vec3(n, 1, grid.z)"), Ok(Val::Ints(vec![5, 1, 4])));
    assert_eq!(eval("vec2(n, eps)"), Ok(Val::Floats(vec![5.0, 0.5])));
    assert_eq!(eval("at.y"), Ok(Val::Float(-1.0)));
    assert_eq!(eval("vec2(n, eps) * 2"), Ok(Val::Floats(vec![10.0, 1.0])));
    assert_eq!(eval("grid.xz + 1"), Ok(Val::Ints(vec![3, 5])));
    assert_eq!(eval("grid.zzx.y"), Ok(Val::Int(4)));
    assert_eq!(eval("max(grid, 3)"), Ok(Val::Ints(vec![3, 3, 4])));
    assert_eq!(eval("min(vec2(n, eps), vec2(1, 1))"), Ok(Val::Floats(vec![1.0, 0.5])));
    assert_eq!(eval("floor(n * 0.3) + ceil(eps) + round(2.5)"), Ok(Val::Int(5)));
    assert_eq!(eval("round(vec2(n, eps) * 1.2)"), Ok(Val::Ints(vec![6, 1])));
    assert_eq!(eval("clamp(n, 1, 3) - clamp(eps, 1.0, 2.0)"), Ok(Val::Float(2.0)));
    assert_eq!(eval("(0 - 7) % 4"), Ok(Val::Int(1)));
    assert_eq!(eval("1.5e+1"), Ok(Val::Float(15.0)));
    assert_eq!(eval("2E2"), Ok(Val::Float(200.0)));
    assert_eq!(eval("pow(2, 10)"), Ok(Val::Int(1024)));
    assert_eq!(eval("pow(2.0, 0 - 1)"), Ok(Val::Float(0.5)));
    assert_eq!(eval("abs(0 - 3) + abs(n)"), Ok(Val::Int(8)));
    assert_eq!(eval("n ? on ? 1 : 2 : 3"), Ok(Val::Int(1)));
    // Those that bind alike go from the left.
    assert_eq!(eval("7 * 4 % 3"), Ok(Val::Int(1)));
    assert_eq!(eval("7 % 4 * 3"), Ok(Val::Int(9)));
    assert_eq!(eval("8 / 4 * 2"), Ok(Val::Int(4)));
    assert_eq!(eval("8 * 3 / 4 % 4"), Ok(Val::Int(2)));
    assert_eq!(eval("1 - 2 + 3"), Ok(Val::Int(2)));
}

#[test]
fn truths_and_vectors_are_equal_or_not() {
    for (text, truth) in [
        ("on == true", true),
        ("on == false", false),
        ("on != true", false),
        ("on != false", true),
        ("grid == vec3(2, 3, 4)", true),
        ("grid == vec3(2, 3, 5)", false),
        ("grid != vec3(2, 3, 4)", false),
        ("grid != vec3(2, 3, 5)", true),
        ("n == 5", true),
        ("n != 5", false),
        ("n == 5.0", true),
        ("eps <= 0.5", true),
        ("eps >= 0.5", true),
        ("n <= 4", false),
        ("n >= 6", false),
        // Comparisons bind alike too: the first gives a truth.
        ("1 < 2 == true", true),
    ] {
        assert_eq!(eval(text), Ok(Val::Bool(truth)), "{text}");
    }
    says("grid == vec2(2, 3)", "don't go together");
    says("at == at", "don't go together");
    says("grid == n", "don't go together");
    says("on < on", "don't go together");
}

#[test]
fn faults_are_reported_not_wrapped() {
    says("9223372036854775807 + 1", "64 bits");
    says("9223372036854775808", "64 bits");
    says("abs(-9223372036854775807 - 1)", "64 bits");
    says("-(-9223372036854775807 - 1)", "64 bits");
    says("1 / (n - 5)", "zero");
    says("1 % (n - 5)", "zero");
    says("pow(10, 40)", "64 bits");
    says("pow(10.0, 400)", "64 bits");
    says("pow(2, 0 - 1)", "64 bits");
    says("log2(0)", "positive");
    says("n n", "unexpected");
    says("mim(1, 2)", "`min`");
    says("min(1)", "takes 2");
    says("min(1 2)", "`,` or `)`");
    says("n ? 1", "expected `:`");
    says("(n", "expected `)`");
    says("grid.a", "has no value");
    says("(n + 1).a", "expected `x`");
    says("grid.w", "no such component");
    says("n.x", "an integer has no such component");
    says("at.z", "a vector of floats has no such component");
    says("nothing", "has no value");
    says("!n", "can't be done to an integer");
    says("-on", "can't be done to a boolean");
    says("-grid", "can't be done to a vector of integers");
    says("eps && on", "expected a condition, found a float");
    says("on + 1", "a boolean and an integer don't go together");
    says("grid + vec2(1, 1)", "don't go together");
    says("grid < grid", "don't go together");
    says("on == 1", "don't go together");
    says("vec2(grid, 1)", "`vec2` can't take");
    says("floor(1e300)", "64 bits");
    says("grid.xw", "component");
    says("max(grid, vec2(1, 2))", "`max` can't take");
    says("1.2.3", "not a number");
    says(&"(".repeat(100_000), "deep");
    says(&"-".repeat(100_000), "deep");
    says("", "expected a number");
}

#[test]
fn limits_are_where_they_are_said_to_be() {
    let sum = |operators| format!("1{}", " + 1".repeat(operators));
    assert_eq!(eval(&sum(OPERATORS)), Ok(Val::Int(OPERATORS as i64 + 1)));
    says(&sum(OPERATORS + 1), "too long");
    let nested = |depth| format!("{}1{}", "(".repeat(depth), ")".repeat(depth));
    assert_eq!(eval(&nested(DEPTH - 1)), Ok(Val::Int(1)));
    says(&nested(DEPTH), "too deep");
    let minus = |depth| format!("{}1", "-".repeat(depth));
    assert_eq!(eval(&minus(DEPTH - 1)), Ok(Val::Int(-1)));
    says(&minus(DEPTH), "too deep");
    // Beside each other they are not deep.
    assert_eq!(eval(&vec!["(-1)"; 200].join(" + ")), Ok(Val::Int(-200)));
    let path = |steps| format!("grid{}", ".x".repeat(steps));
    says(&path(OPERATORS + 1), "too long");
}

#[test]
fn a_fault_stands_at_its_part_of_the_expression() {
    let text = "1 + max(2, 3 / (n - 5))";
    let d = eval(text).unwrap_err();
    assert_eq!(d.labels[0].0.text(), "3 / (n - 5)");
    let text = "foo + 1";
    let d = eval(text).unwrap_err();
    assert_eq!(d.labels[0].0.text(), "foo");
    let text = "1 + mim(2, 3)";
    assert_eq!(eval(text).unwrap_err().labels[0].0.text(), "mim");
    let place = |text| {
        let span = &eval(text).unwrap_err().labels[0].0;
        span.start..span.end
    };
    assert_eq!(place("1 + $ + 2"), 4..5);
    assert_eq!(place("1 +"), 3..3);
    assert_eq!(place("(1"), 2..2);
}

#[test]
fn every_name_is_named_once_for_each_place() {
    let text = "a.x + -b * (c ? d : max(e, a))";
    let e = Expr::parse(&Span::whole(&Source::new("e", text)), text).unwrap();
    let mut found = vec![];
    e.names(&mut |name, span| found.push((name, span.start)));
    assert_eq!(found, [("a", 0), ("b", 7), ("c", 12), ("d", 16), ("e", 24), ("a", 27)]);
}

#[test]
fn values_become_those_of_shaders_where_they_fit() {
    let max = i64::from(u32::MAX);
    assert_eq!(Val::Int(max).to_value(), Some(Value::Uint(u32::MAX)));
    assert_eq!(Val::Int(max + 1).to_value(), None);
    assert_eq!(Val::Int(-1).to_value(), Some(Value::Int(-1)));
    assert_eq!(Val::Int(i64::from(i32::MIN) - 1).to_value(), None);
    assert_eq!(Val::Bool(true).to_value(), Some(Value::Bool(true)));
    assert_eq!(Val::Float(0.5).to_value(), Some(Value::Float(0.5)));
    assert_eq!(Val::Ints(vec![1, 2]).to_value(), Some(Value::UVec2(UVec2::new(1, 2))));
    assert_eq!(Val::Ints(vec![1, 2, 3]).to_value(), Some(Value::UVec3(UVec3::new(1, 2, 3))));
    assert_eq!(Val::Ints(vec![1, -2, 3]).to_value(), None);
    assert_eq!(Val::Ints(vec![1]).to_value(), None);
    assert_eq!(Val::Floats(vec![1.0, 2.0]).to_value(), Some(Value::Vec2(Vec2::new(1.0, 2.0))));
    assert_eq!(Val::Floats(vec![1.0, 2.0, 3.0]).to_value(), Some(Value::Vec3(Vec3::new(1.0, 2.0, 3.0))));
    assert_eq!(Val::Floats(vec![1.0, 2.0, 3.0, 4.0]).to_value(), Some(Value::Vec4(Vec4::new(1.0, 2.0, 3.0, 4.0))));
    assert_eq!(Val::Floats(vec![1.0; 5]).to_value(), None);
    for value in [
        Value::Bool(false),
        Value::Uint(7),
        Value::Float(0.25),
        Value::UVec2(UVec2::new(1, 2)),
        Value::UVec3(UVec3::new(1, 2, 3)),
        Value::Vec2(Vec2::new(1.0, 2.0)),
        Value::Vec3(Vec3::new(1.0, 2.0, 3.0)),
        Value::Vec4(Vec4::new(1.0, 2.0, 3.0, 4.0)),
    ] {
        assert_eq!(Val::from(value).to_value(), Some(value));
    }
    assert_eq!(Val::from(Value::Int(-3)), Val::Int(-3));
    assert_eq!(Val::from(Value::UVec4(glam::UVec4::new(1, 2, 3, 4))), Val::Ints(vec![1, 2, 3, 4]));
    assert_eq!(Val::from(Value::Mat4(glam::Mat4::IDENTITY)).noun(), "a vector of floats");
}

/// An expression that never was text.
#[derive(Debug, Clone)]
enum Tree {
    Int(i64),
    Float(f64),
    Name(&'static str),
    Part(Box<Tree>, usize),
    Minus(Box<Tree>),
    Not(Box<Tree>),
    Two(&'static str, Box<Tree>, Box<Tree>),
    Choose(Box<Tree>, Box<Tree>, Box<Tree>),
    Call(&'static str, Vec<Tree>),
}

/// How closely an operator binds, from docs/language.md.
fn binds(operator: &str) -> u8 {
    match operator {
        "||" => 1,
        "&&" => 2,
        "+" | "-" => 4,
        "*" | "/" | "%" => 5,
        _ => 3,
    }
}

impl Tree {
    /// With no more brackets than are needed where at least `least` must bind.
    fn text(&self, least: u8) -> String {
        let (binding, text) = match self {
            Tree::Int(i) => (8, i.to_string()),
            Tree::Float(x) => (8, format!("{x:?}")),
            Tree::Name(n) => (8, (*n).to_string()),
            Tree::Part(of, part) => (7, format!("{}.{}", of.text(7), ["x", "y", "z", "w"][*part])),
            Tree::Minus(of) => (6, format!("-{}", of.text(6))),
            Tree::Not(of) => (6, format!("! {}", of.text(6))),
            Tree::Two(op, a, b) => (binds(op), format!("{} {op}{}", a.text(binds(op)), b.text(binds(op) + 1))),
            Tree::Choose(c, a, b) => (0, format!("{}?{} : {}", c.text(1), a.text(0), b.text(0))),
            Tree::Call(f, of) => (8, format!("{f}({})", of.iter().map(|t| t.text(0)).collect::<Vec<_>>().join(" ,"))),
        };
        if binding < least { format!("({text})") } else { text }
    }

    fn value(&self) -> Told {
        Ok(match self {
            Tree::Int(i) => N::Whole(vec![i128::from(*i)], true),
            Tree::Float(x) => N::Real(vec![*x], true),
            Tree::Name("n") => N::Whole(vec![5], true),
            Tree::Name("grid") => N::Whole(vec![2, 3, 4], false),
            Tree::Name("eps") => N::Real(vec![0.5], true),
            Tree::Name("at") => N::Real(vec![0.25, -1.0], false),
            Tree::Name("on") => N::Truth(true),
            Tree::Name("true") => N::Truth(true),
            Tree::Name("false") => N::Truth(false),
            Tree::Name(_) => return Err("has no value"),
            Tree::Part(of, i) => match of.value()? {
                N::Whole(v, false) if *i < v.len() => N::Whole(vec![v[*i]], true),
                N::Real(v, false) if *i < v.len() => N::Real(vec![v[*i]], true),
                _ => return Err("no such component"),
            },
            Tree::Minus(of) => match of.value()? {
                N::Whole(v, true) => whole(-v[0])?,
                N::Real(v, true) => N::Real(vec![-v[0]], true),
                _ => return Err("can't be done"),
            },
            Tree::Not(of) => match of.value()? {
                N::Truth(b) => N::Truth(!b),
                _ => return Err("can't be done"),
            },
            Tree::Two("&&", a, b) => N::Truth(a.condition()? && b.condition()?),
            Tree::Two("||", a, b) => N::Truth(a.condition()? || b.condition()?),
            Tree::Two(op, a, b) => two(op, a.value()?, b.value()?)?,
            Tree::Choose(c, a, b) => match c.condition()? {
                true => a.value()?,
                false => b.value()?,
            },
            Tree::Call(f, of) => call(f, of.iter().map(Tree::value).collect::<Result<_, _>>()?)?,
        })
    }

    fn condition(&self) -> Result<bool, &'static str> {
        match self.value()? {
            N::Truth(b) => Ok(b),
            N::Whole(v, true) => Ok(v[0] != 0),
            _ => Err("expected a condition"),
        }
    }
}

/// A value of the other evaluator: truths, and rows of numbers that stand alone (`true`) or are vectors.
#[derive(Debug, Clone, PartialEq)]
enum N {
    Truth(bool),
    Whole(Vec<i128>, bool),
    Real(Vec<f64>, bool),
}

type Told = Result<N, &'static str>;

fn whole(x: i128) -> Told {
    if (-(1i128 << 63)..1i128 << 63).contains(&x) { Ok(N::Whole(vec![x], true)) } else { Err("64 bits") }
}

fn real(n: &N) -> Option<f64> {
    match n {
        N::Whole(v, true) => Some(v[0] as f64),
        N::Real(v, true) => Some(v[0]),
        _ => None,
    }
}

fn whole_of(op: &str, x: i128, y: i128) -> Result<i128, &'static str> {
    let rest = |y: i128| ((x % y) + y.abs()) % y.abs();
    let n = match op {
        "+" => x + y,
        "-" => x - y,
        "*" => x * y,
        _ if y == 0 => return Err("division by zero"),
        // The quotient has no place in 64 bits, and the machine gives no remainder without it.
        _ if y == -1 && x == -(1i128 << 63) => return Err("64 bits"),
        "/" => (x - rest(y)) / y,
        _ => rest(y),
    };
    whole(n).map(|_| n)
}

fn two(op: &str, a: N, b: N) -> Told {
    let compares = ["==", "!=", "<", "<=", ">", ">="].contains(&op);
    let equal = |same: bool| Ok(N::Truth(same == (op == "==")));
    match (&a, &b) {
        (N::Truth(x), N::Truth(y)) if op == "==" || op == "!=" => equal(x == y),
        (N::Whole(x, false), N::Whole(y, false)) if x.len() == y.len() && (op == "==" || op == "!=") => equal(x == y),
        (N::Whole(x, true), N::Whole(y, true)) if compares => Ok(N::Truth(ordered(op, x[0] - y[0]))),
        (N::Whole(x, true), N::Whole(y, true)) => Ok(N::Whole(vec![whole_of(op, x[0], y[0])?], true)),
        (N::Whole(x, _), N::Whole(y, _)) if !compares && (x.len() == y.len() || x.len() == 1 || y.len() == 1) => {
            let n = x.len().max(y.len());
            let at = |v: &[i128], i: usize| if v.len() == 1 { v[0] } else { v[i] };
            let parts = (0..n).map(|i| whole_of(op, at(x, i), at(y, i))).collect::<Result<_, _>>()?;
            Ok(N::Whole(parts, false))
        }
        _ if !compares && (parts(&a).len() > 1 || parts(&b).len() > 1) => {
            let rows = rows(&[a, b]).ok_or("don't go together")?;
            together(rows.into_iter().map(|row| two(op, row[0].clone(), row[1].clone())))
        }
        _ => {
            let (Some(x), Some(y)) = (real(&a), real(&b)) else { return Err("don't go together") };
            if compares {
                return Ok(N::Truth(match op {
                    "==" => x == y,
                    "!=" => x != y,
                    "<" => x < y,
                    "<=" => x <= y,
                    ">" => x > y,
                    _ => x >= y,
                }));
            }
            let rest = x % y;
            Ok(N::Real(
                vec![match op {
                    "+" => x + y,
                    "-" => x - y,
                    "*" => x * y,
                    "/" => x / y,
                    _ if rest < 0.0 => rest + y.abs(),
                    _ => rest,
                }],
                true,
            ))
        }
    }
}

/// The numbers of a value, each alone; none of a truth.
fn parts(n: &N) -> Vec<N> {
    match n {
        N::Truth(_) => vec![],
        N::Whole(v, _) => v.iter().map(|x| N::Whole(vec![*x], true)).collect(),
        N::Real(v, _) => v.iter().map(|x| N::Real(vec![*x], true)).collect(),
    }
}

/// What goes together of some values, component by component; a number that stands alone goes with each.
fn rows(of: &[N]) -> Option<Vec<Vec<N>>> {
    let all: Vec<Vec<N>> = of.iter().map(parts).collect();
    let n = all.iter().map(Vec::len).max()?;
    let fits = all.iter().all(|v| v.len() == n || v.len() == 1);
    fits.then(|| (0..n).map(|i| all.iter().map(|v| v[if v.len() == 1 { 0 } else { i }].clone()).collect()).collect())
}

/// A vector of numbers.
fn together(parts: impl Iterator<Item = Told>) -> Told {
    let all = parts.collect::<Result<Vec<N>, _>>()?;
    let wholes: Option<Vec<i128>> =
        all.iter().map(|n| if let N::Whole(v, _) = n { Some(v[0]) } else { None }).collect();
    Ok(match wholes {
        Some(v) => N::Whole(v, false),
        None => N::Real(all.iter().filter_map(real).collect(), false),
    })
}

fn ordered(op: &str, difference: i128) -> bool {
    match op {
        "==" => difference == 0,
        "!=" => difference != 0,
        "<" => difference < 0,
        "<=" => difference <= 0,
        ">" => difference > 0,
        _ => difference >= 0,
    }
}

fn call(f: &str, of: Vec<N>) -> Told {
    let alone: Option<Vec<f64>> = of.iter().map(real).collect();
    let wholes: Option<Vec<i128>> =
        of.iter().map(|n| if let N::Whole(v, true) = n { Some(v[0]) } else { None }).collect();
    match (f, wholes, alone) {
        ("min", Some(v), _) => whole(if v[0] < v[1] { v[0] } else { v[1] }),
        ("max", Some(v), _) => whole(if v[0] > v[1] { v[0] } else { v[1] }),
        ("abs", Some(v), _) => whole(if v[0] < 0 { -v[0] } else { v[0] }),
        ("log2", Some(v), _) if v[0] <= 0 => Err("isn't positive"),
        ("log2", Some(v), _) => whole((0..63).filter(|i| v[0] >> i > 0).max().unwrap_or(0)),
        ("pow", Some(v), _) if v[1] < 0 || v[1] > i128::from(u32::MAX) => Err("64 bits"),
        ("pow", Some(v), _) => match v[0] {
            0 | 1 => whole(if v[1] == 0 { 1 } else { v[0] }),
            -1 => whole(if v[1] % 2 == 0 { 1 } else { -1 }),
            _ if v[1] > 64 => Err("64 bits"),
            base => (0..v[1]).try_fold(1i128, |n, _| whole(n * base).map(|_| n * base)).and_then(whole),
        },
        ("vec2" | "vec3", Some(v), _) => Ok(N::Whole(v, false)),
        ("min", None, Some(v)) => Ok(N::Real(vec![v[0].min(v[1])], true)),
        ("max", None, Some(v)) => Ok(N::Real(vec![v[0].max(v[1])], true)),
        ("abs", None, Some(v)) => Ok(N::Real(vec![if v[0] < 0.0 { -v[0] } else { v[0] }], true)),
        ("pow", None, Some(v)) => match v[0].powf(v[1]) {
            power if power.is_finite() => Ok(N::Real(vec![power], true)),
            _ => Err("64 bits"),
        },
        ("vec2" | "vec3", None, Some(v)) => Ok(N::Real(v, false)),
        ("ceil_div", ..) => match of.as_slice() {
            [a, N::Whole(by, true)] => two("/", two("+", a.clone(), whole(by[0] - 1)?)?, N::Whole(by.clone(), true)),
            _ => Err("can't take"),
        },
        ("min" | "max" | "abs", ..) if of.iter().any(|n| parts(n).len() > 1) => {
            let rows = rows(&of).ok_or("can't take")?;
            together(rows.into_iter().map(|row| call(f, row)))
        }
        _ => Err("can't take"),
    }
}

fn agree(ours: &Result<Val, Diagnostic>, theirs: &Told) -> bool {
    let same = |x: f64, y: f64| x == y || (x.is_nan() && y.is_nan());
    match (ours, theirs) {
        (Ok(Val::Bool(a)), Ok(N::Truth(b))) => a == b,
        (Ok(Val::Int(a)), Ok(N::Whole(b, true))) => i128::from(*a) == b[0],
        (Ok(Val::Float(a)), Ok(N::Real(b, true))) => same(*a, b[0]),
        (Ok(Val::Ints(a)), Ok(N::Whole(b, false))) => a.iter().map(|x| i128::from(*x)).eq(b.iter().copied()),
        (Ok(Val::Floats(a)), Ok(N::Real(b, false))) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(*a, *b)),
        (Err(d), Err(why)) => d.message.contains(why),
        _ => false,
    }
}

const OPERATORS_OF_TWO: [&str; 13] = ["+", "-", "*", "/", "%", "==", "!=", "<", "<=", ">", ">=", "&&", "||"];

fn trees() -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        4 => (0i64..10).prop_map(Tree::Int),
        1 => prop_oneof![Just(i64::MAX), Just(1i64 << 40), Just(3_037_000_500)].prop_map(Tree::Int),
        2 => prop_oneof![Just(0.5), Just(2.0), Just(0.0), Just(1e300), Just(3.25)].prop_map(Tree::Float),
        4 => prop_oneof![Just("n"), Just("grid"), Just("eps"), Just("at"), Just("on"), Just("true"), Just("false"), Just("nobody")]
            .prop_map(Tree::Name),
    ];
    leaf.prop_recursive(5, 48, 3, |of| {
        let one = of.clone().prop_map(Box::new);
        let (a, b, c) = (one.clone(), one.clone(), one.clone());
        prop_oneof![
            6 => (prop::sample::select(&OPERATORS_OF_TWO[..]), one.clone(), one.clone()).prop_map(|(op, a, b)| Tree::Two(op, a, b)),
            2 => (one.clone(), 0usize..4).prop_map(|(a, i)| Tree::Part(a, i)),
            1 => one.clone().prop_map(Tree::Minus),
            1 => one.clone().prop_map(Tree::Not),
            1 => (a, b, c).prop_map(|(a, b, c)| Tree::Choose(a, b, c)),
            1 => (prop_oneof![Just("abs"), Just("log2")], of.clone()).prop_map(|(f, a)| Tree::Call(f, vec![a])),
            3 => (prop::sample::select(&["min", "max", "ceil_div", "pow", "vec2"][..]), of.clone(), of.clone())
                .prop_map(|(f, a, b)| Tree::Call(f, vec![a, b])),
            1 => (of.clone(), of.clone(), of).prop_map(|(a, b, c)| Tree::Call("vec3", vec![a, b, c])),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6000, ..ProptestConfig::default() })]

    #[test]
    fn what_is_read_is_what_was_meant(tree in trees()) {
        let text = tree.text(0);
        let (ours, theirs) = (eval(&text), tree.value());
        prop_assert!(agree(&ours, &theirs), "{text}\ngives {ours:?}\nand is {theirs:?}");
    }
}
