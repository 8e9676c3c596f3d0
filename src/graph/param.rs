//! Values of parameters: what a parameter accepts, and how the command line writes it.

use super::ast::Param;
use super::expr::Val;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::scene::KeyedParam;
use crate::value::{Type, Value};

impl Param {
    /// Whether a value has the right type and lies in the range.
    ///
    /// # Errors
    /// What is wrong with it, as the end of a sentence: "below the minimum 1".
    pub fn accepts(&self, value: &Value) -> Result<(), String> {
        let parts = |v: &Value| match Val::from(*v) {
            Val::Bool(b) => vec![f64::from(u8::from(b))],
            Val::Int(i) => vec![i as f64],
            Val::Float(f) => vec![f],
            Val::Ints(v) => v.into_iter().map(|i| i as f64).collect(),
            Val::Floats(v) => v,
        };
        let v = parts(value);
        if value.ty() != self.ty {
            return Err(format!("not of type {}", self.ty.wgsl()));
        }
        if v.iter().any(|x| !x.is_finite()) {
            return Err("not finite".into());
        }
        if let Some(min) = &self.min
            && v.iter().zip(parts(min)).any(|(a, b)| *a < b)
        {
            return Err(format!("below the minimum {min}"));
        }
        if let Some(max) = &self.max
            && v.iter().zip(parts(max)).any(|(a, b)| *a > b)
        {
            return Err(format!("above the maximum {max}"));
        }
        Ok(())
    }

    /// The value that a scene file gives at a time. What has a fraction goes evenly from keyframe to keyframe, all else
    /// jumps.
    ///
    /// # Errors
    /// Every value that the parameter does not take.
    pub fn at(&self, keyed: &KeyedParam, time: f32) -> Checked<Value> {
        let (mut values, mut faults) = (vec![], vec![]);
        for (_, text) in &keyed.keys {
            match self.of(&keyed.name, text) {
                Ok(value) => values.push(value),
                Err(why) => {
                    let d = Diagnostic::error(why).at(&keyed.span, "").at(&self.span, "declared here");
                    if !faults.contains(&d) {
                        faults.push(d);
                    }
                }
            }
        }
        Faults::check(faults, ())?;
        let (a, b, share) = keyed.around(time);
        Ok(values[a].towards(&values[b], share))
    }

    /// Reads a value for the parameter of this name.
    ///
    /// # Errors
    /// Why it takes no such value.
    pub fn of(&self, name: &str, text: &str) -> Result<Value, String> {
        let value = self.read(text).ok_or_else(|| format!("`{name}`: `{text}` is not a {}", self.ty.wgsl()))?;
        self.accepts(&value).map_err(|why| format!("parameter `{name}` = {value} is {why}"))?;
        Ok(value)
    }

    /// Reads a value as the command line writes it: `4`, `0.5`, `true`, `4,4,4`; a vector's single number stands for
    /// all.
    pub fn read(&self, text: &str) -> Option<Value> {
        let words: Vec<&str> = text.trim_matches(['(', ')']).split(',').map(str::trim).collect();
        match (self.ty, words[..].len()) {
            (Type::Bool, 1) => words[0].parse().ok().map(Value::Bool),
            (Type::Uint, 1) => words[0].parse().ok().map(Value::Uint),
            (Type::Int, 1) => words[0].parse().ok().map(Value::Int),
            (Type::Float, 1) => words[0].parse::<f32>().ok().filter(|x| x.is_finite()).map(Value::Float),
            (ty, 1) => {
                let n = match ty {
                    Type::UVec2 | Type::Vec2 => 2,
                    Type::UVec3 | Type::Vec3 => 3,
                    _ => 4,
                };
                parse_vector(&vec![words[0]; n], ty)
            }
            (ty, _) => parse_vector(&words, ty),
        }
    }
}

/// A vector of a type from the words of its components.
pub(super) fn parse_vector(words: &[&str], ty: Type) -> Option<Value> {
    let val = match ty {
        Type::UVec2 | Type::UVec3 | Type::UVec4 => {
            Val::Ints(words.iter().map(|w| w.parse::<u32>().ok().map(i64::from)).collect::<Option<_>>()?)
        }
        Type::Vec2 | Type::Vec3 | Type::Vec4 => {
            let number = |w: &&str| w.parse::<f32>().ok().filter(|x| x.is_finite()).map(f64::from);
            Val::Floats(words.iter().map(number).collect::<Option<_>>()?)
        }
        _ => return None,
    };
    val.to_value().filter(|v| v.ty() == ty)
}
