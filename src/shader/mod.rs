//! WGSL text to a validated naga module and its [`Interface`]. No device.
//!
//! `compose` resolves `#import` and definitions (the only place that knows naga_oil), gives every resource
//! variable a binding in group 0, validates, and reflects. `layout` packs named values into the bytes a
//! shader expects.

pub mod compose;
pub mod interface;
pub mod layout;

pub use compose::{Def, Defs, Library, Shader, compose};
pub use interface::{
    Access, BindingKind, Entry, Interface, Output, OutputKind, Stage, TextureDim, TextureSample, Variable, VertexInput,
};
pub use layout::{Layout, Member};
