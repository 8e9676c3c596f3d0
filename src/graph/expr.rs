//! The expressions of graph files: small, checked, without side effects.

mod compute;
mod parse;

use crate::diag::{Diagnostic, Span};
use crate::value::Value;
use glam::{UVec2, UVec3, Vec2, Vec3, Vec4};
pub use parse::FUNCTIONS;

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
    /// Of a set, the resource of a number.
    Item(String, Box<Expr>),
    /// Components by their places: one is a number, more are a vector.
    Parts(Box<Expr>, Vec<usize>),
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
    Clamp,
    Abs,
    Floor,
    Ceil,
    Round,
    CeilDiv,
    Log2,
    Pow,
    Vector,
}

impl Function {
    /// As graph files write it.
    fn name(self, values: usize) -> &'static str {
        parse::FUNCTIONS.iter().find(|f| f.1 == self && f.2 == values).map_or("", |f| f.0)
    }
}

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
    pub(super) fn noun(&self) -> &'static str {
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
    /// Calls `f` with each name in the expression and its place.
    pub fn names<'a>(&'a self, f: &mut impl FnMut(&'a str, &'a Span)) {
        match &self.kind {
            ExprKind::Number(_) => {}
            ExprKind::Name(n) => f(n, &self.span),
            ExprKind::Item(n, index) => {
                f(n, &self.span);
                index.names(f);
            }
            ExprKind::Parts(a, _) | ExprKind::Unary(_, a) => a.names(f),
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

    /// Gives every name in the expression another.
    pub fn rename(&mut self, name: &dyn Fn(&str) -> String) {
        match &mut self.kind {
            ExprKind::Number(_) => {}
            ExprKind::Name(n) => *n = name(n),
            ExprKind::Item(n, index) => {
                *n = name(n);
                index.rename(name);
            }
            ExprKind::Parts(a, _) | ExprKind::Unary(_, a) => a.rename(name),
            ExprKind::Binary(_, a, b) => {
                a.rename(name);
                b.rename(name);
            }
            ExprKind::Choose(a, b, c) => {
                a.rename(name);
                b.rename(name);
                c.rename(name);
            }
            ExprKind::Call(_, args) => args.iter_mut().for_each(|a| a.rename(name)),
        }
    }

    /// Puts values in place of names that have one.
    pub fn substitute(&mut self, value: &dyn Fn(&str) -> Option<Val>) {
        match &mut self.kind {
            ExprKind::Number(_) => {}
            ExprKind::Name(n) => {
                if let Some(v) = value(n) {
                    self.kind = ExprKind::Number(v);
                }
            }
            ExprKind::Item(n, index) => {
                index.substitute(value);
                if let Ok(Val::Int(i)) = index.eval(&|_| None) {
                    self.kind = ExprKind::Name(item(n, i));
                }
            }
            ExprKind::Parts(a, _) | ExprKind::Unary(_, a) => a.substitute(value),
            ExprKind::Binary(_, a, b) => {
                a.substitute(value);
                b.substitute(value);
            }
            ExprKind::Choose(a, b, c) => {
                a.substitute(value);
                b.substitute(value);
                c.substitute(value);
            }
            ExprKind::Call(_, args) => args.iter_mut().for_each(|a| a.substitute(value)),
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
            ExprKind::Item(n, index) => match index.eval(name)? {
                Val::Int(i) => name(&item(n, i))
                    .ok_or_else(|| Diagnostic::error(format!("`{}` has no value here", item(n, i))).at(&self.span, "")),
                other => {
                    Err(Diagnostic::error(format!("a number of a member is {}", other.noun())).at(&index.span, ""))
                }
            },
            ExprKind::Parts(a, parts) => match (a.eval(name)?, &parts[..]) {
                (Val::Ints(v), [i]) if *i < v.len() => Ok(Val::Int(v[*i])),
                (Val::Floats(v), [i]) if *i < v.len() => Ok(Val::Float(v[*i])),
                (Val::Ints(v), _) if parts.iter().all(|i| *i < v.len()) => {
                    Ok(Val::Ints(parts.iter().map(|i| v[*i]).collect()))
                }
                (Val::Floats(v), _) if parts.iter().all(|i| *i < v.len()) => {
                    Ok(Val::Floats(parts.iter().map(|i| v[*i]).collect()))
                }
                (other, _) => {
                    Err(Diagnostic::error(format!("{} has no such component", other.noun())).at(&self.span, ""))
                }
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
}

/// The name of the resource of a number in a set.
pub fn item(set: &str, index: i64) -> String {
    format!("{set}[{index}]")
}

#[cfg(test)]
mod tests;
