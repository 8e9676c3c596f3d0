//! Byte layouts reflected from a shader, and packing named values into them.

use crate::value::{Type, Value};

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
}

impl Layout {
    /// Writes the values into `out`, which is `size` long and zeroed. `value` is asked for each member by name.
    /// Returns the names that `value` did not know or that do not fit the member's type.
    pub fn pack(&self, out: &mut [u8], value: impl Fn(&str) -> Option<Value>) -> Vec<&Member> {
        let mut missing = vec![];
        for member in &self.members {
            match value(&member.name).and_then(|v| v.cast(member.ty)) {
                Some(v) => {
                    let bytes = v.bytes();
                    let at = member.offset as usize;
                    out[at..at + bytes.len()].copy_from_slice(&bytes);
                }
                None => missing.push(member),
            }
        }
        missing
    }
}
