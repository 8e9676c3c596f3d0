//! A plan as people and other programs read it: text, JSON, DOT, SVG, and the difference of two.
//!
//! `words` names the parts, `fold` draws equal steps together, `text` is `Display` of [`super::Plan`]. `network` sees
//! passes and what flows between them, `layout` gives them places, `picture` names what stands there, `dot` and `svg`
//! draw it.

mod diff;
mod dot;
mod fold;
mod json;
mod layout;
mod network;
mod picture;
mod svg;
mod text;
mod words;

#[cfg(test)]
mod tests;

pub use diff::diff;
pub use dot::to_dot;
pub use json::to_json;
pub use network::{COLLAPSED, sub_graphs};
pub use picture::{PassBox, Picture, PortBox, Rect, WireLine, picture};
pub use svg::to_svg;
