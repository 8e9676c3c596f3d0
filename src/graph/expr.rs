//! The expressions of graph files: small, checked, without side effects.

use crate::diag::{Diagnostic, Span};
use crate::value::Value;
use glam::{UVec2, UVec3, Vec2, Vec3, Vec4};

/// An expression and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub span: Span,
    pub kind: ExprKind,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    Number(Val),
    Name(String),
    Component(Box<Expr>, usize),
    Unary(Unary, Box<Expr>),
    Binary(Binary, Box<Expr>, Box<Expr>),
    Choose(Box<Expr>, Box<Expr>, Box<Expr>),
    Call(Function, Vec<Expr>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unary {
    Minus,
    Not,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Rem,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    And,
    Or,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    Min,
    Max,
    Abs,
    CeilDiv,
    Log2,
    Pow,
    Vector,
}

const FUNCTIONS: [(&str, Function, usize); 8] = [
    ("min", Function::Min, 2),
    ("max", Function::Max, 2),
    ("abs", Function::Abs, 1),
    ("ceil_div", Function::CeilDiv, 2),
    ("log2", Function::Log2, 1),
    ("pow", Function::Pow, 2),
    ("vec2", Function::Vector, 2),
    ("vec3", Function::Vector, 3),
];

/// What an expression gives.
#[derive(Debug, Clone, PartialEq)]
pub enum Val {
    Bool(bool),
    Int(i64),
    Float(f64),
    Ints(Vec<i64>),
    Floats(Vec<f64>),
}

impl Val {
    fn noun(&self) -> &'static str {
        match self {
            Val::Bool(_) => "a boolean",
            Val::Int(_) => "an integer",
            Val::Float(_) => "a float",
            Val::Ints(_) => "a vector of integers",
            Val::Floats(_) => "a vector of floats",
        }
    }

    /// As a [`Value`] for shaders and uniforms; `None` when it doesn't fit 32 bits.
    pub fn to_value(&self) -> Option<Value> {
        let int = |x: i64| u32::try_from(x).ok();
        Some(match self {
            Val::Bool(b) => Value::Bool(*b),
            Val::Int(i) => match u32::try_from(*i) {
                Ok(u) => Value::Uint(u),
                Err(_) => Value::Int(i32::try_from(*i).ok()?),
            },
            Val::Float(f) => Value::Float(*f as f32),
            Val::Ints(v) => match v[..] {
                [x, y] => Value::UVec2(UVec2::new(int(x)?, int(y)?)),
                [x, y, z] => Value::UVec3(UVec3::new(int(x)?, int(y)?, int(z)?)),
                _ => return None,
            },
            Val::Floats(v) => match v[..] {
                [x, y] => Value::Vec2(Vec2::new(x as f32, y as f32)),
                [x, y, z] => Value::Vec3(Vec3::new(x as f32, y as f32, z as f32)),
                [x, y, z, w] => Value::Vec4(Vec4::new(x as f32, y as f32, z as f32, w as f32)),
                _ => return None,
            },
        })
    }
}

impl From<Value> for Val {
    fn from(v: Value) -> Val {
        let f = |v: &[f32]| Val::Floats(v.iter().map(|x| f64::from(*x)).collect());
        match v {
            Value::Bool(b) => Val::Bool(b),
            Value::Uint(u) => Val::Int(u.into()),
            Value::Int(i) => Val::Int(i.into()),
            Value::Float(x) => Val::Float(x.into()),
            Value::UVec2(v) => Val::Ints(v.to_array().map(i64::from).to_vec()),
            Value::UVec3(v) => Val::Ints(v.to_array().map(i64::from).to_vec()),
            Value::UVec4(v) => Val::Ints(v.to_array().map(i64::from).to_vec()),
            Value::Vec2(v) => f(&v.to_array()),
            Value::Vec3(v) => f(&v.to_array()),
            Value::Vec4(v) => f(&v.to_array()),
            Value::Mat4(v) => f(&v.to_cols_array()),
        }
    }
}

impl Expr {
    /// Parses `text`, which stands at `span`'s start.
    ///
    /// # Errors
    /// The first fault of syntax.
    pub fn parse(span: &Span, text: &str) -> Result<Expr, Diagnostic> {
        let mut p = Parser { span, text, at: 0, depth: 0, operators: 0 };
        let e = p.choose()?;
        p.skip();
        if p.at < text.len() {
            return Err(p.fault("unexpected text in the expression"));
        }
        Ok(e)
    }

    /// Calls `f` with each name in the expression and its place.
    pub fn names<'a>(&'a self, f: &mut impl FnMut(&'a str, &'a Span)) {
        match &self.kind {
            ExprKind::Number(_) => {}
            ExprKind::Name(n) => f(n, &self.span),
            ExprKind::Component(a, _) | ExprKind::Unary(_, a) => a.names(f),
            ExprKind::Binary(_, a, b) => {
                a.names(f);
                b.names(f);
            }
            ExprKind::Choose(a, b, c) => {
                a.names(f);
                b.names(f);
                c.names(f);
            }
            ExprKind::Call(_, args) => args.iter().for_each(|a| a.names(f)),
        }
    }

    /// The value, with names looked up by `name`.
    ///
    /// # Errors
    /// Unknown names, wrong types, overflow, division by zero; at the part of the expression where it happens.
    pub fn eval(&self, name: &dyn Fn(&str) -> Option<Val>) -> Result<Val, Diagnostic> {
        match &self.kind {
            ExprKind::Number(v) => Ok(v.clone()),
            ExprKind::Name(n) => {
                name(n).ok_or_else(|| Diagnostic::error(format!("`{n}` has no value here")).at(&self.span, ""))
            }
            ExprKind::Component(a, i) => match a.eval(name)? {
                Val::Ints(v) if *i < v.len() => Ok(Val::Int(v[*i])),
                Val::Floats(v) if *i < v.len() => Ok(Val::Float(v[*i])),
                other => Err(Diagnostic::error(format!("{} has no such component", other.noun())).at(&self.span, "")),
            },
            ExprKind::Unary(op, a) => match (op, a.eval(name)?) {
                (Unary::Not, Val::Bool(b)) => Ok(Val::Bool(!b)),
                (Unary::Minus, Val::Int(i)) => i.checked_neg().map(Val::Int).ok_or_else(|| self.overflow()),
                (Unary::Minus, Val::Float(x)) => Ok(Val::Float(-x)),
                (_, other) => {
                    Err(Diagnostic::error(format!("this can't be done to {}", other.noun())).at(&self.span, ""))
                }
            },
            ExprKind::Binary(Binary::And, a, b) => Ok(Val::Bool(a.truth(name)? && b.truth(name)?)),
            ExprKind::Binary(Binary::Or, a, b) => Ok(Val::Bool(a.truth(name)? || b.truth(name)?)),
            ExprKind::Binary(op, a, b) => self.binary(*op, &a.eval(name)?, &b.eval(name)?),
            ExprKind::Choose(c, a, b) => if c.truth(name)? { a } else { b }.eval(name),
            ExprKind::Call(f, args) => {
                let args = args.iter().map(|a| a.eval(name)).collect::<Result<Vec<_>, _>>()?;
                self.call(*f, &args)
            }
        }
    }

    /// The value as a truth: booleans as they are, integers when not zero.
    ///
    /// # Errors
    /// As [`Expr::eval`], and values that are neither.
    pub fn truth(&self, name: &dyn Fn(&str) -> Option<Val>) -> Result<bool, Diagnostic> {
        match self.eval(name)? {
            Val::Bool(b) => Ok(b),
            Val::Int(i) => Ok(i != 0),
            other => Err(Diagnostic::error(format!("expected a condition, found {}", other.noun())).at(&self.span, "")),
        }
    }

    fn overflow(&self) -> Diagnostic {
        Diagnostic::error("the result doesn't fit 64 bits").at(&self.span, "overflows")
    }

    fn binary(&self, op: Binary, a: &Val, b: &Val) -> Result<Val, Diagnostic> {
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
            (Val::Ints(_) | Val::Int(_), Val::Ints(_) | Val::Int(_)) => {
                let parts = pair(ints(a), ints(b)).ok_or_else(mixed)?.into_iter();
                let parts = parts.map(|(x, y)| match self.binary(op, &Val::Int(x), &Val::Int(y))? {
                    Val::Int(i) => Ok(i),
                    _ => Err(mixed()),
                });
                Ok(Val::Ints(parts.collect::<Result<_, _>>()?))
            }
            _ => Err(mixed()),
        }
    }

    fn call(&self, f: Function, args: &[Val]) -> Result<Val, Diagnostic> {
        let wrong = || Diagnostic::error("wrong types for this function").at(&self.span, "");
        match (f, args) {
            (Function::Min, [Val::Int(a), Val::Int(b)]) => Ok(Val::Int(*a.min(b))),
            (Function::Max, [Val::Int(a), Val::Int(b)]) => Ok(Val::Int(*a.max(b))),
            (Function::Min, [a @ (Val::Int(_) | Val::Float(_)), b @ (Val::Int(_) | Val::Float(_))]) => {
                Ok(Val::Float(float(a).min(float(b))))
            }
            (Function::Max, [a @ (Val::Int(_) | Val::Float(_)), b @ (Val::Int(_) | Val::Float(_))]) => {
                Ok(Val::Float(float(a).max(float(b))))
            }
            (Function::Abs, [Val::Int(a)]) => a.checked_abs().map(Val::Int).ok_or_else(|| self.overflow()),
            (Function::Abs, [Val::Float(a)]) => Ok(Val::Float(a.abs())),
            (Function::CeilDiv, [a, b @ Val::Int(_)]) => {
                let up = self.binary(Binary::Add, a, &self.binary(Binary::Sub, b, &Val::Int(1))?)?;
                self.binary(Binary::Div, &up, b)
            }
            (Function::Log2, [Val::Int(a)]) if *a > 0 => Ok(Val::Int(a.ilog2().into())),
            (Function::Log2, [Val::Int(_)]) => {
                Err(Diagnostic::error("log2 of a number that isn't positive").at(&self.span, ""))
            }
            (Function::Pow, [Val::Int(a), Val::Int(b)]) => {
                u32::try_from(*b).ok().and_then(|b| a.checked_pow(b)).map(Val::Int).ok_or_else(|| self.overflow())
            }
            (Function::Pow, [a @ (Val::Int(_) | Val::Float(_)), b @ (Val::Int(_) | Val::Float(_))]) => {
                let power = float(a).powf(float(b));
                if power.is_finite() { Ok(Val::Float(power)) } else { Err(self.overflow()) }
            }
            (Function::Vector, _) if args.iter().all(|a| matches!(a, Val::Int(_))) => {
                Ok(Val::Ints(args.iter().flat_map(ints).collect()))
            }
            (Function::Vector, _) if args.iter().all(|a| matches!(a, Val::Int(_) | Val::Float(_))) => {
                Ok(Val::Floats(args.iter().map(float).collect()))
            }
            _ => Err(wrong()),
        }
    }
}

fn float(v: &Val) -> f64 {
    match v {
        Val::Int(i) => *i as f64,
        Val::Float(f) => *f,
        _ => f64::NAN,
    }
}

fn ints(v: &Val) -> Vec<i64> {
    match v {
        Val::Int(i) => vec![*i],
        Val::Ints(v) => v.clone(),
        _ => vec![],
    }
}

/// Component by component; a scalar goes with every component.
fn pair(a: Vec<i64>, b: Vec<i64>) -> Option<Vec<(i64, i64)>> {
    let n = a.len().max(b.len());
    let fits = |v: &Vec<i64>| v.len() == 1 || v.len() == n;
    (fits(&a) && fits(&b)).then(|| (0..n).map(|i| (a[i % a.len()], b[i % b.len()])).collect())
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

/// Deeper nesting than this is a fault, so that no text can overflow the stack.
const DEPTH: usize = 64;

/// Longer chains of operators are a fault: they make trees as deep as they are long.
const OPERATORS: usize = 200;

struct Parser<'a> {
    span: &'a Span,
    text: &'a str,
    at: usize,
    depth: usize,
    operators: usize,
}

impl Parser<'_> {
    fn skip(&mut self) {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
    }

    fn fault(&self, message: &str) -> Diagnostic {
        let start = self.span.start + self.at;
        Diagnostic::error(message)
            .at(&Span::new(&self.span.source, start..(start + 1).min(self.span.end.max(start))), "")
    }

    fn take(&mut self, token: &str) -> bool {
        self.skip();
        let found = self.text[self.at..].starts_with(token);
        if found {
            self.at += token.len();
        }
        found
    }

    fn count_operator(&mut self) -> Result<(), Diagnostic> {
        self.operators += 1;
        if self.operators > OPERATORS { Err(self.fault("the expression is too long")) } else { Ok(()) }
    }

    fn expr(&self, start: usize, kind: ExprKind) -> Expr {
        Expr { span: Span::new(&self.span.source, self.span.start + start..self.span.start + self.at), kind }
    }

    fn choose(&mut self) -> Result<Expr, Diagnostic> {
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(self.fault("the expression is nested too deep"));
        }
        self.skip();
        let start = self.at;
        let mut e = self.joined(0)?;
        if self.take("?") {
            let a = self.choose()?;
            if !self.take(":") {
                return Err(self.fault("expected `:`"));
            }
            let b = self.choose()?;
            e = self.expr(start, ExprKind::Choose(Box::new(e), Box::new(a), Box::new(b)));
        }
        self.depth -= 1;
        Ok(e)
    }

    /// Operands joined by operators that bind at least as closely as `least`.
    fn joined(&mut self, least: u8) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        let mut e = self.unary()?;
        while let Some((token, binds, op)) = self.operator().filter(|o| o.1 >= least) {
            self.at += token.len();
            self.count_operator()?;
            let right = self.joined(binds + 1)?;
            e = self.expr(start, ExprKind::Binary(op, Box::new(e), Box::new(right)));
        }
        Ok(e)
    }

    /// The operator that comes next, and how closely it binds.
    fn operator(&mut self) -> Option<(&'static str, u8, Binary)> {
        // Longer tokens come first; `<` must not take the start of `<=`.
        const OPERATORS: [(&str, u8, Binary); 13] = [
            ("||", 0, Binary::Or),
            ("&&", 1, Binary::And),
            ("==", 2, Binary::Equal),
            ("!=", 2, Binary::NotEqual),
            ("<=", 2, Binary::LessEqual),
            (">=", 2, Binary::GreaterEqual),
            ("<", 2, Binary::Less),
            (">", 2, Binary::Greater),
            ("+", 3, Binary::Add),
            ("-", 3, Binary::Sub),
            ("*", 4, Binary::Mul),
            ("/", 4, Binary::Div),
            ("%", 4, Binary::Rem),
        ];
        self.skip();
        let rest = &self.text[self.at..];
        OPERATORS.into_iter().find(|(token, ..)| rest.starts_with(token))
    }

    fn unary(&mut self) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        let op = if self.take("-") {
            Unary::Minus
        } else if self.take("!") {
            Unary::Not
        } else {
            return self.postfix();
        };
        self.depth += 1;
        if self.depth > DEPTH {
            return Err(self.fault("the expression is nested too deep"));
        }
        let inner = self.unary()?;
        self.depth -= 1;
        Ok(self.expr(start, ExprKind::Unary(op, Box::new(inner))))
    }

    fn postfix(&mut self) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        let mut e = self.primary()?;
        while self.take(".") {
            let rest = &self.text[self.at..];
            let Some(i) = rest.chars().next().and_then(|c| "xyzw".find(c)) else {
                return Err(self.fault("expected `x`, `y`, `z` or `w`"));
            };
            self.at += 1;
            self.count_operator()?;
            e = self.expr(start, ExprKind::Component(Box::new(e), i));
        }
        Ok(e)
    }

    fn primary(&mut self) -> Result<Expr, Diagnostic> {
        self.skip();
        let start = self.at;
        if self.take("(") {
            let e = self.choose()?;
            if !self.take(")") {
                return Err(self.fault("expected `)`"));
            }
            return Ok(e);
        }
        let rest = &self.text[self.at..];
        let first = rest.chars().next();
        if first.is_some_and(|c| c.is_ascii_digit()) {
            let mut end = 0;
            let bytes = rest.as_bytes();
            while end < bytes.len()
                && (bytes[end].is_ascii_digit()
                    || bytes[end] == b'.' && bytes.get(end + 1).is_some_and(u8::is_ascii_digit)
                    || matches!(bytes[end], b'e' | b'E')
                    || matches!(bytes[end], b'+' | b'-') && matches!(bytes[end - 1], b'e' | b'E'))
            {
                end += 1;
            }
            let number = &rest[..end];
            let val = match number.parse::<i64>() {
                Ok(i) => Val::Int(i),
                Err(_) if number.contains(['.', 'e', 'E']) => {
                    number.parse().map(Val::Float).map_err(|_| self.fault("not a number"))?
                }
                Err(_) => return Err(self.fault("the number doesn't fit 64 bits")),
            };
            self.at += end;
            return Ok(self.expr(start, ExprKind::Number(val)));
        }
        let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
        if end == 0 {
            return Err(self.fault("expected a number, a name or `(`"));
        }
        let name = rest[..end].to_string();
        self.at += end;
        let after_name = self.at;
        if self.take("(") {
            let Some((_, f, arity)) = FUNCTIONS.iter().find(|(n, ..)| *n == name) else {
                let d = Diagnostic::error(format!("unknown function `{name}`"));
                let span = Span::new(&self.span.source, self.span.start + start..self.span.start + after_name);
                return Err(d.at(&span, "").nearest(&name, FUNCTIONS.iter().map(|f| f.0)));
            };
            let mut args = vec![];
            while !self.take(")") {
                if !args.is_empty() && !self.take(",") {
                    return Err(self.fault("expected `,` or `)`"));
                }
                args.push(self.choose()?);
            }
            if args.len() != *arity {
                return Err(self.fault(&format!("`{name}` takes {arity} values")));
            }
            return Ok(self.expr(start, ExprKind::Call(*f, args)));
        }
        self.at = after_name;
        Ok(match name.as_str() {
            "true" => self.expr(start, ExprKind::Number(Val::Bool(true))),
            "false" => self.expr(start, ExprKind::Number(Val::Bool(false))),
            _ => self.expr(start, ExprKind::Name(name)),
        })
    }
}

#[cfg(test)]
mod tests;
