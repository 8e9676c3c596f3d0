//! An evaluator that shares nothing with the one tested: it works on trees that never were text, in 128 bits.

/// An expression that never was text.
#[derive(Debug, Clone)]
pub(super) enum Tree {
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
    pub(super) fn text(&self, least: u8) -> String {
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

    pub(super) fn value(&self) -> Told {
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
pub(super) enum N {
    Truth(bool),
    Whole(Vec<i128>, bool),
    Real(Vec<f64>, bool),
}

pub(super) type Told = Result<N, &'static str>;

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
