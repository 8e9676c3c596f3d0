//! Spherical harmonics, sampling, colour: the CPU twins of what shaders compute.
//!
//! Everything is in `f64`, so that a test can hold a shader's `f32` against it.

pub mod cube;
pub mod grid;
pub mod lobe;
pub mod sh;
