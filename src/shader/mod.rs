//! WGSL text to a validated naga module and its [`Interface`]. No device.
//!
//! `compose` resolves `#import` and definitions (nothing outside this module knows naga_oil), gives every resource
//! variable a binding in group 0, validates, and reflects. `layout` packs named values into the bytes a
//! shader expects.
//!
//! Inside: `lex` finds words, `scan` settles conditions and reads imports, `outline` lists what a file declares, `link`
//! follows imports, `write` spells the text for naga_oil and leads its places back, `oil` calls it, `bind` gives
//! bindings, `limits` refuses what would exhaust stack or memory, `reflect` reads the [`Interface`]; `report` is the
//! module by which shaders check themselves, `memo` keeps what was made of the same texts before, `kept` what other
//! runs of a program joined; `survey` is what editors ask of a file, `probe` a copy of a shader that notes what it
//! computes.

mod bind;
pub mod compose;
mod imports;
pub mod interface;
mod kept;
pub mod layout;
mod lex;
pub mod library;
mod limits;
mod link;
mod memo;
mod oil;
mod outline;
pub mod probe;
mod reflect;
pub mod report;
mod scan;
mod survey;
mod write;

#[cfg(test)]
mod tests;

pub use compose::{Def, Defs, Shader, compose};
pub use imports::Import;
pub use interface::{
    Access, BindingKind, ElementType, EntryPoint, Interface, Output, OutputKind, Stage, TextureDim, TextureSample,
    Variable, VertexInput,
};
pub use kept::{keep_joined_in, kept_module};
pub use layout::{Layout, Member, plain_bytes};
pub use lex::{Token, TokenKind};
pub use library::Library;
pub use memo::{Index, Memo};
pub use outline::{Declared, Outline};
pub use survey::{Survey, survey};
