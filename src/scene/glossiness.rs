//! Converts materials of `KHR_materials_pbrSpecularGlossiness` to metallic ones: finds the base colour, metalness and
//! roughness that look most like a diffuse colour, a specular one and glossiness.

use super::textures::TextureImage;
use crate::image::srgb;
use glam::{Vec3, Vec4};

/// What a face of the ior of 1.5 reflects head on.
pub(super) const HEAD_ON: f32 = 0.04;

/// The factors and textures of such a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GlossyMaterial {
    /// Whether its image is that of its specular colour; else that of its diffuse one.
    pub shiny: bool,
    /// Texture of the diffuse colour beside it, read alike.
    pub diffuse_texture: Option<usize>,
    pub diffuse: Vec4,
    pub specular: Vec3,
    pub glossiness: f32,
}

/// A map that its images are converted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ConvertedMap {
    BaseColor,
    /// Roughness in green, metalness in blue.
    Finish,
}

impl GlossyMaterial {
    /// Converts its image, and that of its diffuse colour beside it, to a map as large as the larger one.
    pub fn image(&self, made: ConvertedMap, own: &TextureImage, beside: Option<&TextureImage>) -> TextureImage {
        let [width, height] = larger(own.size(), beside.map(TextureImage::size));
        let light: [f32; 256] = std::array::from_fn(|code| srgb::decode(code as f32 / 255.0));
        let lit = |t: [u8; 4]| {
            Vec4::new(light[t[0] as usize], light[t[1] as usize], light[t[2] as usize], f32::from(t[3]) / 255.0)
        };
        let plain = |x: f32| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let texel = |x: u32, y: u32| {
            let at = |image: &TextureImage| {
                let [w, h] = image.size();
                lit(image.texels[(y * h / height * w + x * w / width) as usize])
            };
            let (shine, matte) = match self.shiny {
                true => (at(own), beside.map_or(Vec4::ONE, at)),
                false => (Vec4::ONE, at(own)),
            };
            let diffuse = self.diffuse * matte;
            let (base, metallic) = metal_of(diffuse.truncate(), self.specular * shine.truncate());
            match made {
                ConvertedMap::BaseColor => {
                    let [r, g, b] = base.to_array().map(srgb::nearest);
                    [r, g, b, plain(diffuse.w)]
                }
                ConvertedMap::Finish => [255, plain(1.0 - self.glossiness * shine.w), plain(metallic), 255],
            }
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        TextureImage { width, height, texels }
    }
}

/// The size of a map converted from two images.
pub(super) fn larger([width, height]: [u32; 2], other: Option<[u32; 2]>) -> [u32; 2] {
    other.map_or([width, height], |[w, h]| [width.max(w), height.max(h)])
}

/// The base colour and metalness that look most like a diffuse and a specular colour (after the conversion that the
/// Khronos Group gives beside the extension's text).
pub(super) fn metal_of(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let brightness = |c: Vec3| (c * c).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt();
    let kept = 1.0 - specular.max_element();
    let (bright, shiny) = (brightness(diffuse), brightness(specular));
    // The metalness at which a base colour gives both.
    let b = bright * kept / (1.0 - HEAD_ON) + shiny - 2.0 * HEAD_ON;
    let root = (b * b + 4.0 * HEAD_ON * (shiny - HEAD_ON)).max(0.0).sqrt();
    let metallic = if shiny < HEAD_ON { 0.0 } else { ((root - b) / (2.0 * HEAD_ON)).clamp(0.0, 1.0) };
    let matte = diffuse * (kept / (1.0 - HEAD_ON) / (1.0 - metallic).max(1e-6));
    let metal = (specular - HEAD_ON * (1.0 - metallic)) / metallic.max(1e-6);
    (matte.lerp(metal, metallic * metallic).clamp(Vec3::ZERO, Vec3::ONE), metallic)
}
