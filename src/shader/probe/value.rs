//! Values as words, and as a person reads them.

use super::super::write::plain;
use naga::{ArraySize, Module, ScalarKind, TypeInner};

/// A value of more words is not noted.
const MOST_WORDS: u32 = 64;

/// What a value is made of. Each number takes a word.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    Number(Number),
    Vector(Number, u32),
    /// Column by column: how many, and how many rows.
    Matrix(Number, u32, u32),
    Array(Box<Shape>, u32),
    Struct(Vec<(String, Shape)>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    Float,
    /// Noted as a float of 32 bits.
    Half,
    Int,
    Uint,
    Bool,
}

impl Shape {
    /// `None` for what holds no numbers, such as pointers and textures, and for what is too large.
    pub(super) fn of(module: &Module, inner: &TypeInner) -> Option<Shape> {
        Shape::unbounded(module, inner, 8).filter(|s| (1..=MOST_WORDS).contains(&s.words()))
    }

    fn unbounded(module: &Module, inner: &TypeInner, depth: u32) -> Option<Shape> {
        let inner_of = |ty| Shape::unbounded(module, &module.types[ty].inner, depth.checked_sub(1)?);
        Some(match inner {
            TypeInner::Scalar(s) => Shape::Number(number(*s)?),
            TypeInner::Vector { size, scalar } => Shape::Vector(number(*scalar)?, *size as u32),
            TypeInner::Matrix { columns, rows, scalar } => {
                Shape::Matrix(number(*scalar)?, *columns as u32, *rows as u32)
            }
            TypeInner::Array { base, size: ArraySize::Constant(n), .. } if n.get() <= MOST_WORDS => {
                Shape::Array(Box::new(inner_of(*base)?), n.get())
            }
            TypeInner::Struct { members, .. } if members.len() <= MOST_WORDS as usize => {
                let member =
                    |m: &naga::StructMember| Some((m.name.as_deref().map(plain).unwrap_or_default(), inner_of(m.ty)?));
                Shape::Struct(members.iter().map(member).collect::<Option<_>>()?)
            }
            _ => return None,
        })
    }

    pub fn words(&self) -> u32 {
        match self {
            Shape::Number(_) => 1,
            Shape::Vector(_, n) => *n,
            Shape::Matrix(_, columns, rows) => columns * rows,
            Shape::Array(of, n) => of.words().saturating_mul(*n),
            Shape::Struct(members) => members.iter().map(|m| m.1.words()).fold(0, u32::saturating_add),
        }
    }

    /// Takes the words of the value, and shows it.
    pub(super) fn show(&self, words: &mut impl Iterator<Item = u32>) -> String {
        let mut row = |number: &Number, n: u32| {
            let all: Vec<String> = (0..n).map(|_| number.show(words.next().unwrap_or(0))).collect();
            format!("({})", all.join(", "))
        };
        match self {
            Shape::Number(number) => number.show(words.next().unwrap_or(0)),
            Shape::Vector(number, n) => row(number, *n),
            Shape::Matrix(number, columns, rows) => {
                let all: Vec<String> = (0..*columns).map(|_| row(number, *rows)).collect();
                format!("({})", all.join(", "))
            }
            Shape::Array(of, n) => {
                let all: Vec<String> = (0..*n).map(|_| of.show(words)).collect();
                format!("[{}]", all.join(", "))
            }
            Shape::Struct(members) => {
                let all: Vec<String> = members.iter().map(|(name, s)| format!("{name}: {}", s.show(words))).collect();
                format!("{{{}}}", all.join(", "))
            }
        }
    }
}

impl Number {
    fn show(self, word: u32) -> String {
        match self {
            Number::Float | Number::Half => f32::from_bits(word).to_string(),
            Number::Int => (word as i32).to_string(),
            Number::Uint => word.to_string(),
            Number::Bool => (word != 0).to_string(),
        }
    }
}

fn number(scalar: naga::Scalar) -> Option<Number> {
    match (scalar.kind, scalar.width) {
        (ScalarKind::Float, 4) => Some(Number::Float),
        (ScalarKind::Float, 2) => Some(Number::Half),
        (ScalarKind::Sint, 4) => Some(Number::Int),
        (ScalarKind::Uint, 4) => Some(Number::Uint),
        (ScalarKind::Bool, _) => Some(Number::Bool),
        _ => None,
    }
}
