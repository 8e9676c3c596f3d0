//! Linear images on the CPU: EXR and PNG files, and error metrics.

/// An image of 32-bit floats in linear light; row 0 is on top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    pub width: u32,
    pub height: u32,
    /// Array layers; 1 for a plain image.
    pub layers: u32,
    /// Values a pixel: 1 to 4.
    pub channels: u32,
    /// `layers × height × width × channels` values.
    pub data: Vec<f32>,
}
