//! A plan as people and other programs look at it: JSON, DOT, SVG, the picture in the window, the difference of two.
//!
//! `network` sees passes and what flows between them, `layout` gives them places, `picture` names what stands there,
//! `dot` and `svg` draw it. As text a plan shows itself.

mod diff;
mod dot;
mod json;
mod layout;
mod network;
mod picture;
mod svg;

#[cfg(test)]
mod tests;

pub use diff::diff;
pub use dot::to_dot;
pub use json::to_json;
#[cfg(feature = "window")]
pub use network::{COLLAPSED, sub_graphs};
#[cfg(feature = "window")]
pub use picture::{PassBox, Picture, PortBox, Rect, WireLine, picture};
pub use svg::to_svg;
