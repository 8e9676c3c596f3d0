//! What operators and functions make of values.

use super::{Binary, Expr, Function, Val};
use crate::diag::Diagnostic;

impl Expr {
    pub(super) fn overflow(&self) -> Diagnostic {
        Diagnostic::error("the result doesn't fit 64 bits").at(&self.span, "overflows")
    }

    pub(super) fn binary(&self, op: Binary, a: &Val, b: &Val) -> Result<Val, Diagnostic> {
        use Binary::{Add, Div, Equal, Greater, GreaterEqual, Less, LessEqual, Mul, NotEqual, Rem, Sub};
        let mixed =
            || Diagnostic::error(format!("{} and {} don't go together here", a.noun(), b.noun())).at(&self.span, "");
        match (a, b) {
            (Val::Int(x), Val::Int(y)) => {
                let zero = || Diagnostic::error("division by zero").at(&self.span, "the divisor is 0");
                let (x, y) = (*x, *y);
                let int = |r: Option<i64>| r.map(Val::Int).ok_or_else(|| self.overflow());
                match op {
                    Add => int(x.checked_add(y)),
                    Sub => int(x.checked_sub(y)),
                    Mul => int(x.checked_mul(y)),
                    Div | Rem if y == 0 => Err(zero()),
                    Div => int(x.checked_div_euclid(y)),
                    Rem => int(x.checked_rem_euclid(y)),
                    _ => Ok(Val::Bool(compare(op, x.partial_cmp(&y)))),
                }
            }
            (Val::Int(_) | Val::Float(_), Val::Int(_) | Val::Float(_)) => {
                let (x, y) = (float(a), float(b));
                match op {
                    Add => Ok(Val::Float(x + y)),
                    Sub => Ok(Val::Float(x - y)),
                    Mul => Ok(Val::Float(x * y)),
                    Div => Ok(Val::Float(x / y)),
                    Rem => Ok(Val::Float(x.rem_euclid(y))),
                    _ => Ok(Val::Bool(compare(op, x.partial_cmp(&y)))),
                }
            }
            (Val::Bool(x), Val::Bool(y)) if matches!(op, Equal | NotEqual) => Ok(Val::Bool((x == y) == (op == Equal))),
            (Val::Ints(x), Val::Ints(y)) if x.len() == y.len() && matches!(op, Equal | NotEqual) => {
                Ok(Val::Bool((x == y) == (op == Equal)))
            }
            _ if matches!(op, Less | LessEqual | Greater | GreaterEqual | Equal | NotEqual) => Err(mixed()),
            _ => self.each(&[a, b], &|v| self.binary(op, v[0], v[1])).unwrap_or_else(|| Err(mixed())),
        }
    }

    pub(super) fn call(&self, f: Function, args: &[Val]) -> Result<Val, Diagnostic> {
        let scalar = |v: &Val| matches!(v, Val::Int(_) | Val::Float(_));
        match (f, args) {
            (Function::Vector, _) if args.iter().all(|a| matches!(a, Val::Int(_))) => {
                Ok(Val::Ints(args.iter().filter_map(whole).collect()))
            }
            (Function::Vector, _) if args.iter().all(scalar) => Ok(Val::Floats(args.iter().map(float).collect())),
            (Function::Vector, _) => Err(self.wrong(f, args)),
            (Function::CeilDiv, [a, b @ Val::Int(_)]) => {
                let up = self.binary(Binary::Add, a, &self.binary(Binary::Sub, b, &Val::Int(1))?)?;
                self.binary(Binary::Div, &up, b)
            }
            _ if args.iter().all(scalar) => self.scalar(f, args),
            (Function::CeilDiv | Function::Log2 | Function::Pow, _) => Err(self.wrong(f, args)),
            _ => {
                let parts = |v: &[&Val]| self.scalar(f, &v.iter().map(|v| (*v).clone()).collect::<Vec<_>>());
                self.each(&args.iter().collect::<Vec<_>>(), &parts).unwrap_or_else(|| Err(self.wrong(f, args)))
            }
        }
    }

    fn wrong(&self, f: Function, args: &[Val]) -> Diagnostic {
        let nouns: Vec<&str> = args.iter().map(Val::noun).collect();
        Diagnostic::error(format!("`{}` can't take {}", f.name(args.len()), nouns.join(" and "))).at(&self.span, "")
    }

    /// A function of numbers.
    fn scalar(&self, f: Function, args: &[Val]) -> Result<Val, Diagnostic> {
        let int = |x: f64| {
            let fits = x >= -(2f64.powi(63)) && x < 2f64.powi(63);
            if fits { Ok(Val::Int(x as i64)) } else { Err(self.overflow()) }
        };
        match (f, args) {
            (Function::Min, [Val::Int(a), Val::Int(b)]) => Ok(Val::Int(*a.min(b))),
            (Function::Max, [Val::Int(a), Val::Int(b)]) => Ok(Val::Int(*a.max(b))),
            (Function::Min, [a, b]) => Ok(Val::Float(float(a).min(float(b)))),
            (Function::Max, [a, b]) => Ok(Val::Float(float(a).max(float(b)))),
            (Function::Clamp, [x, low, high]) => {
                let above = self.scalar(Function::Max, &[x.clone(), low.clone()])?;
                self.scalar(Function::Min, &[above, high.clone()])
            }
            (Function::Abs, [Val::Int(a)]) => a.checked_abs().map(Val::Int).ok_or_else(|| self.overflow()),
            (Function::Abs, [a]) => Ok(Val::Float(float(a).abs())),
            (Function::Floor | Function::Ceil | Function::Round, [Val::Int(a)]) => Ok(Val::Int(*a)),
            (Function::Floor, [a]) => int(float(a).floor()),
            (Function::Ceil, [a]) => int(float(a).ceil()),
            (Function::Round, [a]) => int(float(a).round()),
            (Function::Log2, [Val::Int(a)]) if *a > 0 => Ok(Val::Int(a.ilog2().into())),
            (Function::Log2, [Val::Int(_)]) => {
                Err(Diagnostic::error("log2 of a number that isn't positive").at(&self.span, ""))
            }
            (Function::Pow, [Val::Int(a), Val::Int(b)]) => {
                u32::try_from(*b).ok().and_then(|b| a.checked_pow(b)).map(Val::Int).ok_or_else(|| self.overflow())
            }
            (Function::Pow, [a, b]) => {
                let power = float(a).powf(float(b));
                if power.is_finite() { Ok(Val::Float(power)) } else { Err(self.overflow()) }
            }
            _ => Err(self.wrong(f, args)),
        }
    }

    /// Component by component; a scalar goes with every component. `None`: lengths differ, or something has no
    /// components.
    fn each(
        &self,
        vectors: &[&Val],
        of: &dyn Fn(&[&Val]) -> Result<Val, Diagnostic>,
    ) -> Option<Result<Val, Diagnostic>> {
        let parts: Vec<Vec<Val>> = vectors.iter().map(|v| components(v)).collect::<Option<_>>()?;
        let n = parts.iter().map(Vec::len).max()?;
        if parts.iter().any(|v| v.len() != 1 && v.len() != n) {
            return None;
        }
        let one = |i: usize| of(&parts.iter().map(|v| &v[i % v.len()]).collect::<Vec<_>>());
        Some((0..n).map(one).collect::<Result<Vec<_>, _>>().map(|all| {
            let ints: Option<Vec<i64>> = all.iter().map(whole).collect();
            ints.map_or_else(|| Val::Floats(all.iter().map(float).collect()), Val::Ints)
        }))
    }
}

fn whole(v: &Val) -> Option<i64> {
    match v {
        Val::Int(i) => Some(*i),
        _ => None,
    }
}

fn components(v: &Val) -> Option<Vec<Val>> {
    match v {
        Val::Int(_) | Val::Float(_) => Some(vec![v.clone()]),
        Val::Ints(v) => Some(v.iter().map(|i| Val::Int(*i)).collect()),
        Val::Floats(v) => Some(v.iter().map(|x| Val::Float(*x)).collect()),
        Val::Bool(_) => None,
    }
}

fn float(v: &Val) -> f64 {
    match v {
        Val::Int(i) => *i as f64,
        Val::Float(f) => *f,
        _ => f64::NAN,
    }
}

fn compare(op: Binary, order: Option<std::cmp::Ordering>) -> bool {
    use std::cmp::Ordering::{Equal, Greater, Less};
    match op {
        Binary::Equal => order == Some(Equal),
        Binary::NotEqual => order != Some(Equal),
        Binary::Less => order == Some(Less),
        Binary::LessEqual => matches!(order, Some(Less | Equal)),
        Binary::Greater => order == Some(Greater),
        Binary::GreaterEqual => matches!(order, Some(Greater | Equal)),
        _ => false,
    }
}
