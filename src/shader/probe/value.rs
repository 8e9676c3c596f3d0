//! Values as words, and as a person reads them.

use super::super::write::plain;
use naga::{ArraySize, Module, ScalarKind, TypeInner};

/// A value of more words is not noted.
const MOST_WORDS: u32 = 64;

/// What a value is made of. Each number takes a word.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ValueShape {
    Number(Number),
    Vector(Number, u32),
    /// Column by column: how many, and how many rows.
    Matrix(Number, u32, u32),
    Array(Box<ValueShape>, u32),
    Struct(Vec<(String, ValueShape)>),
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

impl ValueShape {
    /// `None` for what holds no numbers, such as pointers and textures, and for what is too large.
    pub(super) fn of(module: &Module, inner: &TypeInner) -> Option<ValueShape> {
        ValueShape::unbounded(module, inner, 8).filter(|s| (1..=MOST_WORDS).contains(&s.words()))
    }

    fn unbounded(module: &Module, inner: &TypeInner, depth: u32) -> Option<ValueShape> {
        let inner_of = |ty| ValueShape::unbounded(module, &module.types[ty].inner, depth.checked_sub(1)?);
        Some(match inner {
            TypeInner::Scalar(s) => ValueShape::Number(number(*s)?),
            TypeInner::Vector { size, scalar } => ValueShape::Vector(number(*scalar)?, *size as u32),
            TypeInner::Matrix { columns, rows, scalar } => {
                ValueShape::Matrix(number(*scalar)?, *columns as u32, *rows as u32)
            }
            TypeInner::Array { base, size: ArraySize::Constant(n), .. } if n.get() <= MOST_WORDS => {
                ValueShape::Array(Box::new(inner_of(*base)?), n.get())
            }
            TypeInner::Struct { members, .. } if members.len() <= MOST_WORDS as usize => {
                let member =
                    |m: &naga::StructMember| Some((m.name.as_deref().map(plain).unwrap_or_default(), inner_of(m.ty)?));
                ValueShape::Struct(members.iter().map(member).collect::<Option<_>>()?)
            }
            _ => return None,
        })
    }

    pub fn words(&self) -> u32 {
        match self {
            ValueShape::Number(_) => 1,
            ValueShape::Vector(_, n) => *n,
            ValueShape::Matrix(_, columns, rows) => columns * rows,
            ValueShape::Array(of, n) => of.words().saturating_mul(*n),
            ValueShape::Struct(members) => members.iter().map(|m| m.1.words()).fold(0, u32::saturating_add),
        }
    }

    /// Takes the words of the value, and shows it.
    pub(super) fn show(&self, words: &mut impl Iterator<Item = u32>) -> String {
        let mut row = |number: &Number, n: u32| {
            let all: Vec<String> = (0..n).map(|_| number.show(words.next().unwrap_or(0))).collect();
            format!("({})", all.join(", "))
        };
        match self {
            ValueShape::Number(number) => number.show(words.next().unwrap_or(0)),
            ValueShape::Vector(number, n) => row(number, *n),
            ValueShape::Matrix(number, columns, rows) => {
                let all: Vec<String> = (0..*columns).map(|_| row(number, *rows)).collect();
                format!("({})", all.join(", "))
            }
            ValueShape::Array(of, n) => {
                let all: Vec<String> = (0..*n).map(|_| of.show(words)).collect();
                format!("[{}]", all.join(", "))
            }
            ValueShape::Struct(members) => {
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
