//! Values that parameters, facts and frame variables hold, by name.

use glam::{Mat4, UVec2, UVec3, UVec4, Vec2, Vec3, Vec4};
use std::{collections::BTreeMap, fmt};

/// The type of a [`Value`]; also what a shader may declare for a uniform member or a column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Type {
    Bool,
    Uint,
    Int,
    Float,
    UVec2,
    UVec3,
    UVec4,
    Vec2,
    Vec3,
    Vec4,
    Mat4,
}

impl Type {
    /// The name as WGSL writes it.
    pub fn wgsl(self) -> &'static str {
        match self {
            Type::Bool => "bool",
            Type::Uint => "u32",
            Type::Int => "i32",
            Type::Float => "f32",
            Type::UVec2 => "vec2u",
            Type::UVec3 => "vec3u",
            Type::UVec4 => "vec4u",
            Type::Vec2 => "vec2f",
            Type::Vec3 => "vec3f",
            Type::Vec4 => "vec4f",
            Type::Mat4 => "mat4x4f",
        }
    }

    /// Bytes that a value takes in WGSL.
    pub fn size(self) -> u32 {
        match self {
            Type::Bool | Type::Uint | Type::Int | Type::Float => 4,
            Type::UVec2 | Type::Vec2 => 8,
            Type::UVec3 | Type::Vec3 => 12,
            Type::UVec4 | Type::Vec4 => 16,
            Type::Mat4 => 64,
        }
    }

    /// Its place in a struct of WGSL is a multiple of so many bytes.
    pub fn alignment(self) -> u32 {
        self.size().next_power_of_two().min(16)
    }
}

/// One value. Integers are 32 bits wide, as in WGSL.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Value {
    Bool(bool),
    Uint(u32),
    Int(i32),
    Float(f32),
    UVec2(UVec2),
    UVec3(UVec3),
    UVec4(UVec4),
    Vec2(Vec2),
    Vec3(Vec3),
    Vec4(Vec4),
    Mat4(Mat4),
}

impl Value {
    /// The type it has.
    pub fn ty(&self) -> Type {
        match self {
            Value::Bool(_) => Type::Bool,
            Value::Uint(_) => Type::Uint,
            Value::Int(_) => Type::Int,
            Value::Float(_) => Type::Float,
            Value::UVec2(_) => Type::UVec2,
            Value::UVec3(_) => Type::UVec3,
            Value::UVec4(_) => Type::UVec4,
            Value::Vec2(_) => Type::Vec2,
            Value::Vec3(_) => Type::Vec3,
            Value::Vec4(_) => Type::Vec4,
            Value::Mat4(_) => Type::Mat4,
        }
    }

    /// The bytes as WGSL lays the value out (a `bool` as a `u32` of 0 or 1; a `vec3` in 12 bytes).
    pub fn bytes(&self) -> &[u8] {
        match self {
            Value::Bool(false) => bytemuck::bytes_of(&0u32),
            Value::Bool(true) => bytemuck::bytes_of(&1u32),
            Value::Uint(v) => bytemuck::bytes_of(v),
            Value::Int(v) => bytemuck::bytes_of(v),
            Value::Float(v) => bytemuck::bytes_of(v),
            Value::UVec2(v) => bytemuck::bytes_of(v),
            Value::UVec3(v) => bytemuck::bytes_of(v),
            Value::UVec4(v) => bytemuck::bytes_of(v),
            Value::Vec2(v) => bytemuck::bytes_of(v),
            Value::Vec3(v) => bytemuck::bytes_of(v),
            Value::Vec4(v) => bytemuck::bytes_of(v),
            Value::Mat4(v) => bytemuck::bytes_of(v),
        }
    }

    /// What lies a share of the way to another value of the type, where numbers have fractions; else this one.
    pub fn towards(&self, other: &Value, share: f32) -> Value {
        match (*self, *other) {
            (Value::Float(a), Value::Float(b)) => Value::Float(a + (b - a) * share),
            (Value::Vec2(a), Value::Vec2(b)) => Value::Vec2(a.lerp(b, share)),
            (Value::Vec3(a), Value::Vec3(b)) => Value::Vec3(a.lerp(b, share)),
            (Value::Vec4(a), Value::Vec4(b)) => Value::Vec4(a.lerp(b, share)),
            _ => *self,
        }
    }

    /// The value as `ty`, where nothing is lost: the same type, or between `bool`, `u32` and `i32` in range, or to
    /// `f32`.
    pub fn cast(&self, ty: Type) -> Option<Value> {
        if self.ty() == ty {
            return Some(*self);
        }
        match (*self, ty) {
            (Value::Bool(v), Type::Uint) => Some(Value::Uint(v.into())),
            (Value::Bool(v), Type::Int) => Some(Value::Int(v.into())),
            (Value::Uint(v), Type::Int) => i32::try_from(v).ok().map(Value::Int),
            (Value::Int(v), Type::Uint) => u32::try_from(v).ok().map(Value::Uint),
            (Value::Uint(v), Type::Float) => Some(Value::Float(v as f32)),
            (Value::Int(v), Type::Float) => Some(Value::Float(v as f32)),
            (Value::UVec2(v), Type::Vec2) => Some(Value::Vec2(v.as_vec2())),
            (Value::UVec3(v), Type::Vec3) => Some(Value::Vec3(v.as_vec3())),
            _ => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Bool(v) => write!(f, "{v}"),
            Value::Uint(v) => write!(f, "{v}"),
            Value::Int(v) => write!(f, "{v}"),
            Value::Float(v) => write!(f, "{v}"),
            Value::UVec2(v) => write!(f, "({}, {})", v.x, v.y),
            Value::UVec3(v) => write!(f, "({}, {}, {})", v.x, v.y, v.z),
            Value::UVec4(v) => write!(f, "({}, {}, {}, {})", v.x, v.y, v.z, v.w),
            Value::Vec2(v) => write!(f, "({}, {})", v.x, v.y),
            Value::Vec3(v) => write!(f, "({}, {}, {})", v.x, v.y, v.z),
            Value::Vec4(v) => write!(f, "({}, {}, {}, {})", v.x, v.y, v.z, v.w),
            Value::Mat4(v) => write!(f, "{v}"),
        }
    }
}

/// Values by name, in the order of their names.
pub type Values = BTreeMap<String, Value>;
