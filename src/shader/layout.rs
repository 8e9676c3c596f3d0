//! Byte layouts reflected from a shader, and packing named values into them.

use super::{interface::ElementType, reflect::Unbindable, write::plain};
use crate::value::{Type, Value};
use naga::{ArraySize, Handle, Module, ScalarKind, TypeInner, VectorSize};

/// A struct of named members, or one plain value (then `members` has one entry whose name is the variable's).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Layout {
    /// In bytes, padding included.
    pub size: u32,
    pub members: Vec<Member>,
}

/// A member of a [`Layout`].
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Member {
    pub name: String,
    /// From the start of the struct, in bytes.
    pub offset: u32,
    pub ty: Type,
    /// Some entry point may ask for it. Of rows of a table all members count as read.
    pub read: bool,
}

impl Layout {
    /// One after the other, each where WGSL puts a struct's members of these types.
    pub fn of_members<'n>(all: impl Iterator<Item = (&'n str, Type)>) -> Layout {
        let mut members: Vec<Member> = vec![];
        let mut size: u32 = 0;
        for (name, ty) in all {
            let offset = size.next_multiple_of(ty.alignment());
            size = offset + ty.size();
            members.push(Member { name: name.into(), offset, ty, read: true });
        }
        Layout { size, members }
    }

    /// Writes the values into `out`, which is `size` long and zeroed. `value` is asked for each member by name.
    /// Returns the names that `value` did not know or that do not fit the member's type.
    pub fn pack(&self, out: &mut [u8], value: impl Fn(&str) -> Option<Value>) -> Vec<&Member> {
        let mut missing = vec![];
        for member in &self.members {
            match value(&member.name).and_then(|v| v.cast(member.ty)) {
                Some(v) => {
                    let bytes = v.bytes();
                    let at = member.offset as usize;
                    out[at..at + bytes.len()].copy_from_slice(bytes);
                }
                None => missing.push(member),
            }
        }
        missing
    }
}

/// The layout of a uniform variable: a struct of plain values, or one plain value called as the variable is.
///
/// # Errors
/// The first member that no value has the type of, and what to use instead.
pub(super) fn of_uniform(module: &Module, name: &str, ty: Handle<naga::Type>) -> Result<Layout, Unbindable> {
    let inner = &module.types[ty].inner;
    let size = size(module, inner);
    if let Some(members) = flat(module, name, inner) {
        return Ok(Layout { size, members });
    }
    let (culprit, inner) = match inner {
        TypeInner::Struct { members, .. } => members
            .iter()
            .map(|m| (m.name.as_deref().map(plain).unwrap_or_default(), &module.types[m.ty].inner))
            .find(|(_, inner)| plain_type(inner).is_none())
            .unwrap_or((name.to_owned(), inner)),
        inner => (name.to_owned(), inner),
    };
    let help = match inner {
        TypeInner::Matrix { .. } => "use mat4x4f, the only matrix that values come in",
        TypeInner::Array { .. } | TypeInner::Struct { .. } => "use plain members, or a storage buffer",
        TypeInner::Vector { scalar, .. } if scalar.kind == ScalarKind::Sint => "use a vector of u32 or f32",
        _ => "use f32, i32, u32, a vector of f32 or u32, or mat4x4f",
    };
    Err((format!("no value has the type of `{culprit}`"), help.to_owned()))
}

/// The layout of the element of a storage variable or an array, the bytes from one element to the next, and the size of
/// the whole when it has one. An element that is no plain value or struct of them has a size but no members.
pub(super) fn of_array(module: &Module, name: &str, ty: Handle<naga::Type>) -> (Layout, u32, Option<u32>) {
    let whole = &module.types[ty].inner;
    let (element, stride, fixed_size) = match *whole {
        TypeInner::Array { base, size: ArraySize::Dynamic, stride } => (&module.types[base].inner, stride, None),
        TypeInner::Array { base, stride, .. } => (&module.types[base].inner, stride, Some(size(module, whole))),
        _ => (whole, size(module, whole), (!has_open_end(module, whole)).then(|| size(module, whole))),
    };
    let members = flat(module, name, element).unwrap_or_default();
    (Layout { size: size(module, element), members }, stride, fixed_size)
}

/// What an array is of, or a struct, which is an element by itself; `None` of anything else.
pub(super) fn element_type(module: &Module, ty: Handle<naga::Type>) -> Option<ElementType> {
    let element = match &module.types[ty].inner {
        TypeInner::Array { base, .. } => &module.types[*base],
        whole @ TypeInner::Struct { .. } if !has_open_end(module, whole) => &module.types[ty],
        _ => return None,
    };
    Some(match (&element.inner, &element.name) {
        (TypeInner::Struct { .. }, Some(name)) => ElementType::Struct(plain(name)),
        _ => ElementType::Plain,
    })
}

/// Bytes from one to the next in an array of a plain type.
pub fn plain_bytes(name: &str) -> Option<u32> {
    match name {
        "u32" | "i32" | "f32" => Some(4),
        "vec2u" | "vec2i" | "vec2f" => Some(8),
        "vec3u" | "vec3i" | "vec3f" | "vec4u" | "vec4i" | "vec4f" => Some(16),
        "mat4x4f" => Some(64),
        _ => None,
    }
}

/// A struct whose last member is an array without a size.
fn has_open_end(module: &Module, inner: &TypeInner) -> bool {
    let TypeInner::Struct { members, .. } = inner else { return false };
    let last = members.last().map(|m| &module.types[m.ty].inner);
    matches!(last, Some(TypeInner::Array { size: ArraySize::Dynamic, .. }))
}

/// In bytes, padding included.
fn size(module: &Module, inner: &TypeInner) -> u32 {
    inner.size(module.to_ctx())
}

/// The members of a struct of plain values, or the one member that a plain value called `name` is.
fn flat(module: &Module, name: &str, inner: &TypeInner) -> Option<Vec<Member>> {
    if let Some(ty) = plain_type(inner) {
        return Some(vec![Member { name: name.to_owned(), offset: 0, ty, read: true }]);
    }
    let TypeInner::Struct { members, .. } = inner else { return None };
    members
        .iter()
        .map(|m| {
            let ty = plain_type(&module.types[m.ty].inner)?;
            Some(Member { name: m.name.as_deref().map(plain).unwrap_or_default(), offset: m.offset, ty, read: true })
        })
        .collect()
}

fn plain_type(inner: &TypeInner) -> Option<Type> {
    use ScalarKind::{Float, Sint, Uint};
    use VectorSize::{Bi, Quad, Tri};
    match *inner {
        TypeInner::Scalar(s) | TypeInner::Atomic(s) if s.width == 4 => match s.kind {
            Uint => Some(Type::Uint),
            Sint => Some(Type::Int),
            Float => Some(Type::Float),
            _ => None,
        },
        TypeInner::Vector { size, scalar } if scalar.width == 4 => match (scalar.kind, size) {
            (Uint, Bi) => Some(Type::UVec2),
            (Uint, Tri) => Some(Type::UVec3),
            (Uint, Quad) => Some(Type::UVec4),
            (Float, Bi) => Some(Type::Vec2),
            (Float, Tri) => Some(Type::Vec3),
            (Float, Quad) => Some(Type::Vec4),
            _ => None,
        },
        TypeInner::Matrix { columns: Quad, rows: Quad, scalar } if scalar.width == 4 && scalar.kind == Float => {
            Some(Type::Mat4)
        }
        _ => None,
    }
}
