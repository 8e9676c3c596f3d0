//! OpenEXR files: linear values as they are, with what made them as text attributes.

use super::{Image, file::write_atomically};
use crate::caught::caught;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::files;
use ::exr::{
    error::Error as ExrError,
    image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, write::WritableImage},
    math::Vec2,
    meta::{
        MetaData,
        attribute::{AttributeValue, IntegerBounds, Text},
        header::{ImageAttributes, LayerAttributes},
    },
    prelude::{ReadChannels, ReadLayers, SmallVec, read},
};
use half::f16;
use std::{
    collections::{BTreeMap, BTreeSet},
    io::Cursor,
    path::Path,
};

/// How many bits a value takes in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floats: what was rendered, bit for bit.
    Float,
    /// 16-bit floats: rounded to 11 significant bits; beyond ±65504 they become infinite.
    Half,
}

/// What an EXR file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrContents {
    /// The layers in the order of the file, with their names; the only layer of a file often has none ("").
    pub layers: Vec<(String, Image)>,
    /// The text attributes that [`write_exr`] wrote.
    pub metadata: BTreeMap<String, String>,
}

/// Put before the names of our attributes, so that none is taken for one of OpenEXR's own (`version`, `type`, …).
const PREFIX: &str = "lightgraph.";

/// As many values as fit in 2 GiB; a damaged header may ask for far more.
const MAX_VALUES: usize = 1 << 29;

/// Values that a byte of a file may stand for at most, and so many more: a small file that states a large image is
/// damaged. DEFLATE shrinks no text to less than a 1032nd, a value has two bytes or more.
const MAX_SHRUNK: usize = 516;
const MAX_UNPACKED: usize = 1 << 20;

/// Names of the channels of an image of 1 to 4 channels; depth and other scalars are written as luminance.
const CHANNELS: [&[&str]; 4] = [&["Y"], &["R", "G"], &["R", "G", "B"], &["R", "G", "B", "A"]];

/// Writes images as the layers of one EXR file (ZIP compression, scan lines), whole or not at all. An image that is
/// an array becomes one layer for each of its own: "0", "1", … after the name and a full stop, where there is a name.
/// Equal images and metadata give equal bytes.
///
/// # Errors
/// A fault when there is no layer, two have one name, an image contradicts itself, or the file can't be written.
pub fn write_exr(
    path: &Path,
    layers: &[(&str, &Image)],
    precision: Precision,
    metadata: &BTreeMap<String, String>,
) -> Checked<()> {
    write_atomically(path, &encode(path, layers, precision, metadata)?)
}

/// Reads the first layer of an EXR file, half or float: luminance, RGB or RGBA, or whatever its only channel is.
///
/// # Errors
/// A fault that names the file, when it can't be read, is damaged, or has other channels.
pub fn read_exr(path: &Path) -> Checked<Image> {
    from_bytes(path, &files::read(path, files::IMAGE).map_err(|e| unreadable(path, e))?)
}

/// As [`read_exr`], of the bytes of a file.
///
/// # Errors
/// As [`read_exr`].
pub fn from_bytes(path: &Path, bytes: &[u8]) -> Checked<Image> {
    first(path, load(path, bytes, MAX_VALUES)?)
}

/// As [`from_bytes`], of a file of at most so many pixels with four values each, layers counted together.
///
/// # Errors
/// As [`read_exr`], and a larger one: before memory is taken for it.
pub fn from_bytes_up_to(path: &Path, bytes: &[u8], pixels: u64) -> Checked<Image> {
    let values = usize::try_from(4 * pixels).unwrap_or(usize::MAX).min(MAX_VALUES);
    first(path, load(path, bytes, values)?)
}

fn first(path: &Path, decoded: RawImage) -> Checked<Image> {
    let mut layers = decoded.layer_data;
    match layers.is_empty() {
        true => Err(unreadable(path, "it has no layer")),
        false => image_of(path, layers.remove(0)),
    }
}

/// Reads every layer of an EXR file and the metadata.
///
/// # Errors
/// As [`read_exr`], for any of the layers.
pub fn read_exr_contents(path: &Path) -> Checked<ExrContents> {
    let mut contents = ExrContents { layers: vec![], metadata: BTreeMap::new() };
    let bytes = files::read(path, files::IMAGE).map_err(|e| unreadable(path, e))?;
    for layer in load(path, &bytes, MAX_VALUES)?.layer_data {
        let name = layer.attributes.layer_name.as_ref().map(text_of).unwrap_or_default();
        for (key, value) in &layer.attributes.other {
            if let (Some(key), AttributeValue::Text(value)) = (text_of(key).strip_prefix(PREFIX), value) {
                contents.metadata.insert(key.to_string(), text_of(value));
            }
        }
        contents.layers.push((name, image_of(path, layer)?));
    }
    Ok(contents)
}

fn encode(
    path: &Path,
    layers: &[(&str, &Image)],
    precision: Precision,
    metadata: &BTreeMap<String, String>,
) -> Checked<Vec<u8>> {
    let mut names = BTreeSet::new();
    let mut encoded: Vec<Layer<AnyChannels<FlatSamples>>> = vec![];
    let (mut width, mut height) = (0, 0);
    for (name, image) in layers {
        image.check(&format!("layer `{name}` of {}", path.display()))?;
        for index in 0..image.layers {
            let name = match (image.layers, *name) {
                (1, name) => name.to_string(),
                (_, "") => index.to_string(),
                (_, name) => format!("{name}.{index}"),
            };
            encoded.push(layer_of(&name, image, index, precision));
            if !names.insert(name.clone()) {
                return Err(unwritable(path, format!("two layers are called `{name}`")));
            }
        }
        (width, height) = (image.width.max(width), image.height.max(height));
    }
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((width as usize, height as usize)));
    for (key, value) in metadata {
        attributes.other.insert(text(&format!("{PREFIX}{key}")), AttributeValue::Text(text(value)));
    }
    let several = encoded.len() > 1;
    let mut bytes = Cursor::new(vec![]);
    ExrImage::from_layers(attributes, encoded)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|e| unwritable(path, e))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes, several).ok_or_else(|| unwritable(path, "its header is incomplete"))?;
    Ok(bytes)
}

fn layer_of(name: &str, image: &Image, index: u32, precision: Precision) -> Layer<AnyChannels<FlatSamples>> {
    let (width, height, channels) = (image.width as usize, image.height as usize, image.channels as usize);
    let length = width * height * channels;
    let texels = image.data.iter().skip(index as usize * length).take(length);
    let list = CHANNELS[channels - 1].iter().enumerate().map(|(channel, name)| {
        let values = texels.clone().skip(channel).step_by(channels).copied();
        let samples = match precision {
            Precision::Float => FlatSamples::F32(values.collect()),
            Precision::Half => FlatSamples::F16(values.map(f16::from_f32).collect()),
        };
        AnyChannel::new(*name, samples)
    });
    let attributes =
        LayerAttributes { layer_name: (!name.is_empty()).then(|| text(name)), ..LayerAttributes::default() };
    Layer::new((width, height), attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(list.collect()))
}

/// Puts the attributes of each header in the order of their names, as OpenEXR's own library does. The encoder walks
/// a hash map, so without this equal images give files that differ. Lengths stay, and so do all offsets.
fn sort_attributes(bytes: &mut [u8], several: bool) -> Option<()> {
    let after_text = |bytes: &[u8], at: usize| Some(at + bytes.get(at..)?.iter().position(|b| *b == 0)? + 1);
    // The magic number and the version come first.
    let mut at = 8;
    loop {
        let start = at;
        let mut attributes: Vec<Vec<u8>> = vec![];
        while *bytes.get(at)? != 0 {
            let size_at = after_text(bytes, after_text(bytes, at)?)?;
            let size = u32::from_le_bytes(bytes.get(size_at..size_at + 4)?.try_into().ok()?);
            let end = size_at + 4 + size as usize;
            attributes.push(bytes.get(at..end)?.to_vec());
            at = end;
        }
        attributes.sort();
        bytes.get_mut(start..at)?.copy_from_slice(&attributes.concat());
        at += 1;
        // One header ends with its zero byte; a list of them ends with one more.
        if !several || *bytes.get(at)? == 0 {
            return Some(());
        }
    }
}

/// A file as the decoder gives it.
type RawImage = ExrImage<SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>>;

fn load(path: &Path, bytes: &[u8], most: usize) -> Checked<RawImage> {
    // The decoder may panic on damaged files; it holds no state that outlives the call.
    match caught(|| decode(bytes, most)) {
        Some(Ok(image)) => Ok(image),
        Some(Err(e)) => Err(unreadable(path, e)),
        None => Err(unreadable(path, "it is damaged")),
    }
}

fn decode(bytes: &[u8], most: usize) -> Result<RawImage, ExrError> {
    let headers = MetaData::read_from_buffered(bytes, false)?.headers;
    // Memory is taken by what the header says: a damaged one must not end the program.
    let values = headers.iter().try_fold(0usize, |sum, h| {
        h.layer_size.0.checked_mul(h.layer_size.1)?.checked_mul(h.channels.list.len())?.checked_add(sum)
    });
    match values {
        Some(v) if v <= most && v <= bytes.len().saturating_mul(MAX_SHRUNK) + MAX_UNPACKED => {}
        Some(v) if v <= most => {
            return Err(ExrError::NotSupported("far more values than its bytes can hold".into()));
        }
        _ => return Err(ExrError::NotSupported(format!("more than {most} values; make it smaller").into())),
    }
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
}

fn image_of(path: &Path, layer: Layer<AnyChannels<FlatSamples>>) -> Checked<Image> {
    let Vec2(width, height) = layer.size;
    let channels = &layer.channel_data.list;
    let find = |name: &&str| channels.iter().find(|c| text_of(&c.name) == *name);
    let wanted: Option<Vec<_>> = CHANNELS.iter().rev().find_map(|names| names.iter().map(find).collect());
    let chosen = match (wanted, &channels[..]) {
        (Some(chosen), _) => chosen,
        (None, [only]) => vec![only],
        _ => {
            let names: Vec<String> = channels.iter().map(|c| text_of(&c.name)).collect();
            return Err(Diagnostic::error(format!(
                "{} has the channels {}, which make no image",
                path.display(),
                names.join(", ")
            ))
            .help("save it with the channels R, G, B (and A), or with Y alone")
            .into());
        }
    };
    let pixels = width * height;
    if chosen.iter().any(|c| c.sample_data.len() != pixels) {
        return Err(unreadable(path, "its channels differ in resolution"));
    }
    let mut data = vec![0.0; pixels * chosen.len()];
    for (index, channel) in chosen.iter().enumerate() {
        for (to, from) in data.iter_mut().skip(index).step_by(chosen.len()).zip(channel.sample_data.values_as_f32()) {
            *to = from;
        }
    }
    let size = |v: usize| u32::try_from(v).map_err(|_| unreadable(path, "it is too large"));
    Image::new(size(width)?, size(height)?, size(chosen.len())?, data)
}

/// The format has bytes for texts: these are UTF-8, as OpenEXR recommends.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

fn text_of(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn unreadable(path: &Path, reason: impl std::fmt::Display) -> Faults {
    Diagnostic::error(format!("can't read {} as OpenEXR: {reason}", path.display())).into()
}

fn unwritable(path: &Path, reason: impl std::fmt::Display) -> Faults {
    Diagnostic::error(format!("can't write {}: {reason}", path.display())).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::file::tests::Folder;

    fn bits(image: &Image) -> Vec<u32> {
        image.data.iter().map(|v| v.to_bits()).collect()
    }

    fn metadata(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
        pairs.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect()
    }

    /// Values that are easily lost: negative zero, a denormal, the largest, infinity, a NaN with a payload.
    fn awkward(channels: u32) -> Image {
        let special = [0.1, -0.0, f32::from_bits(1), f32::MAX, f32::INFINITY, f32::from_bits(0x7fc0_1234), -3.5e-7];
        let data = special.iter().cycle().take(19 * 33 * channels as usize).copied().collect();
        Image::new(19, 33, channels, data).unwrap()
    }

    #[test]
    fn floats_come_back_bit_for_bit() {
        let folder = Folder::new("exr-float");
        let path = folder.0.join("deep/a.exr");
        for channels in 1..=4 {
            let image = awkward(channels);
            write_exr(&path, &[("", &image)], Precision::Float, &BTreeMap::new()).unwrap();
            let back = read_exr(&path).unwrap();
            assert_eq!((back.width, back.height, back.layers, back.channels), (19, 33, 1, channels));
            assert_eq!(bits(&back), bits(&image), "{channels} channels");
        }
    }

    #[test]
    fn a_small_file_that_states_a_large_image_is_refused_before_memory_is_taken() {
        let folder = Folder::new("exr-bomb");
        let path = folder.0.join("a.exr");
        write_exr(&path, &[("", &Image::filled(4, 4, &[1.0; 3]).unwrap())], Precision::Float, &BTreeMap::new())
            .unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        let window = b"dataWindow\0box2i\0";
        let at = bytes.windows(window.len()).position(|w| w == window).unwrap() + window.len() + 4;
        // The largest column and row.
        bytes[at + 8..at + 12].copy_from_slice(&11_999i32.to_le_bytes());
        bytes[at + 12..at + 16].copy_from_slice(&11_999i32.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let faults = read_exr(&path).unwrap_err();
        assert!(faults.0[0].message.contains("far more values than its bytes can hold"), "{faults}");
    }

    #[test]
    fn halves_come_back_rounded() {
        let folder = Folder::new("exr-half");
        let path = folder.0.join("a.exr");
        let image = Image::new(3, 1, 1, vec![0.1, 2048.0, 1e6]).unwrap();
        write_exr(&path, &[("", &image)], Precision::Half, &BTreeMap::new()).unwrap();
        assert_eq!(read_exr(&path).unwrap().data, [f16::from_f32(0.1).to_f32(), 2048.0, f32::INFINITY]);
    }

    #[test]
    fn arrays_and_metadata_come_back() {
        let folder = Folder::new("exr-layers");
        let path = folder.0.join("a.exr");
        let array = Image::array(2, 1, 2, 3, (0..12).map(|v| v as f32).collect()).unwrap();
        let plain = Image::filled(3, 2, &[7.0]).unwrap();
        let written = metadata(&[("graph", "grid.ron"), ("version", "0.1 → 0.2"), ("empty", "")]);
        write_exr(&path, &[("", &array), ("faces", &array), ("depth", &plain)], Precision::Float, &written).unwrap();
        let contents = read_exr_contents(&path).unwrap();
        let names: Vec<&str> = contents.layers.iter().map(|(n, _)| n.as_str()).collect();
        assert_eq!(names, ["0", "1", "faces.0", "faces.1", "depth"]);
        assert_eq!(contents.layers[1].1, array.layer(1).unwrap());
        assert_eq!(contents.layers[4].1, plain);
        assert_eq!(contents.metadata, written);
        assert_eq!(read_exr(&path).unwrap(), array.layer(0).unwrap());
    }

    #[test]
    fn equal_images_give_equal_bytes() {
        let names: Vec<(String, String)> = (0..12).map(|i| (format!("key {i}"), format!("{i}"))).collect();
        let written: BTreeMap<String, String> = names.into_iter().collect();
        let image = awkward(3);
        let encode = |layers: &[_]| encode(Path::new("a.exr"), layers, Precision::Float, &written).unwrap();
        for layers in [&[("", &image)][..], &[("a", &image), ("b", &image)]] {
            assert_eq!(encode(layers), encode(layers));
        }
    }

    #[test]
    fn layers_that_make_no_file_are_faults() {
        let folder = Folder::new("exr-faults");
        let path = folder.0.join("a.exr");
        let image = awkward(3);
        let odd = Image { width: 4, ..awkward(3) };
        for layers in [&[][..], &[("a", &image), ("a", &image)], &[("a", &odd)]] {
            assert!(write_exr(&path, layers, Precision::Float, &BTreeMap::new()).is_err());
        }
        let long = metadata(&[(&"k".repeat(300), "v")]);
        assert!(write_exr(&path, &[("", &image)], Precision::Float, &long).is_err());
        assert!(folder.names().is_empty());
    }

    #[test]
    fn damaged_files_are_faults_and_no_panics() {
        let folder = Folder::new("exr-damaged");
        let path = folder.0.join("a.exr");
        assert!(read_exr(&path).unwrap_err().0[0].message.contains("a.exr"));
        let image = Image::filled(8, 8, &[0.5, 0.25, 1.0]).unwrap();
        let good = encode(&path, &[("", &image)], Precision::Float, &metadata(&[("graph", "g.ron")])).unwrap();
        for length in (0..good.len()).step_by(7) {
            std::fs::write(&path, &good[..length]).unwrap();
            assert!(read_exr(&path).is_err(), "cut to {length} bytes");
        }
        // A flipped byte may go unnoticed in a pixel or a name; what counts is that the call returns.
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0xff;
            std::fs::write(&path, &bad).unwrap();
            let _ = read_exr_contents(&path);
        }
    }

    #[test]
    fn other_channels_are_a_fault_that_names_them() {
        let samples = || FlatSamples::F32(vec![1.0; 4]);
        let list = ["U", "V"].map(|n| AnyChannel::new(n, samples()));
        let layer = Layer::new(
            (2, 2),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(list.into_iter().collect()),
        );
        let faults = image_of(Path::new("a.exr"), layer).unwrap_err();
        assert!(faults.0[0].message.contains("U, V"), "{faults}");
    }
}
