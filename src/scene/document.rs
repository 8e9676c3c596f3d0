//! A glTF file's JSON and buffers, and checked reads from them.
//!
//! The `gltf` crate's own readers and validation index without checking, so that a malformed file can panic there:
//! only its JSON types are used here, and every index, offset and count is checked before a byte is read.

mod buffers;

use buffers::BufferBytes;
pub(super) use buffers::read_file;

use super::{
    decoded::{self, DecodedParts, MAX_DECODED},
    draco,
    names::short,
};
use crate::diag::{Diagnostic, Source, Span};
use gltf::json::{
    Root,
    accessor::{Accessor, ComponentType, Type},
    validation::Checked,
};
use std::{
    fmt::Display,
    path::{Path, PathBuf},
};

/// What a file may use: by these names, as `extensionsUsed` lists them.
const KNOWN: [&str; 17] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_clearcoat",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "KHR_mesh_quantization",
    "KHR_draco_mesh_compression",
    "KHR_meshopt_compression",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "EXT_mesh_gpu_instancing",
    "KHR_xmp_json_ld",
];

/// A parsed file with its buffers; those of the file itself stay in its bytes.
pub(super) struct Document<'a> {
    pub root: Root,
    /// One for each of `root.buffers`; `None` where it could not be had (and a fault says why).
    buffers: Vec<Option<BufferBytes<'a>>>,
    /// What is not in the buffers as it is read.
    decoded: DecodedParts,
    /// The path as shown.
    pub shown: String,
    /// Where files lie that it names; `None`: it may name none.
    directory: Option<PathBuf>,
}

/// The values of an accessor, all inside their buffer.
#[derive(Clone, Copy)]
struct Elements<'d> {
    bytes: &'d [u8],
    stride: usize,
    size: usize,
    count: usize,
    component: ComponentType,
    /// Integers stand for 0 to 1, or -1 to 1.
    normalized: bool,
}

/// Vertex indices in a buffer, decoded where they are read.
#[derive(Clone, Copy)]
pub(super) struct ElementIndices<'d>(Elements<'d>);

/// Vectors in a buffer, made `f32` where they are read.
#[derive(Clone, Copy)]
pub(super) struct Vectors<'d, const N: usize>(Elements<'d>);

impl<'a> Document<'a> {
    /// Reads `.gltf` or `.glb` bytes. Paths inside are relative to `directory`, without which there may be none;
    /// those read are added to `files`.
    /// `None` when the faults leave nothing to go on with.
    pub fn new(
        bytes: &'a [u8],
        shown: &str,
        directory: Option<&Path>,
        files: &mut Vec<PathBuf>,
        faults: &mut Vec<Diagnostic>,
    ) -> Option<Document<'a>> {
        let (json, blob) = match split(bytes) {
            Ok(parts) => parts,
            Err(why) => {
                faults.push(Diagnostic::error(format!("{shown}: {why}")));
                return None;
            }
        };
        let root = match super::json::root(json, shown) {
            Ok((root, notices)) => {
                faults.extend(notices);
                root
            }
            Err(fault) => {
                faults.push(fault);
                return None;
            }
        };
        let decoded = DecodedParts::default();
        let mut document = Document {
            root,
            buffers: vec![],
            decoded,
            shown: shown.into(),
            directory: directory.map(Path::to_path_buf),
        };
        if !document.root.asset.version.starts_with("2.") {
            let version = &document.root.asset.version;
            faults.push(
                document
                    .error("asset", format!("version {version} is not glTF 2"))
                    .help("export the scene as glTF 2.0"),
            );
        }
        for name in &document.root.extensions_required {
            if !KNOWN.contains(&name.as_str()) {
                let why = format!("extension `{name}` is required but not supported");
                faults.push(document.error("extensionsRequired", why).help("export the scene without it"));
            }
        }
        for name in &document.root.extensions_used {
            if !KNOWN.contains(&name.as_str()) && !document.root.extensions_required.contains(name) {
                faults.push(document.warning("extensionsUsed", format!("extension `{name}` is ignored")));
            }
        }
        document.buffers = document.read_buffers(blob, files, faults);
        if document.complete() {
            document.decoded.views = decoded::views(&document, faults);
            document.decoded.accessors = decoded::sparse(&document, faults);
            let compressed = draco::accessors(&document, faults);
            document.decoded.accessors.extend(compressed);
        }
        Some(document)
    }

    /// Whether every buffer is there.
    pub fn complete(&self) -> bool {
        self.buffers.iter().all(Option::is_some)
    }

    /// A fault in this file: place, then reason.
    pub fn error(&self, place: impl Display, why: impl Display) -> Diagnostic {
        Diagnostic::error(format!("{}: {place}: {why}", self.shown))
    }

    /// Something in this file that is not used as it stands.
    pub fn warning(&self, place: impl Display, why: impl Display) -> Diagnostic {
        Diagnostic::warning(format!("{}: {place}: {why}", self.shown))
    }

    /// An accessor of vectors: of `f32`, or of integers of 8 or 16 bits, as KHR_mesh_quantization has them.
    pub fn floats<const N: usize>(&self, accessor: usize) -> Result<Vectors<'_, N>, String> {
        let shape = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            4 => Type::Vec4,
            _ => Type::Mat4,
        };
        let elements = self.elements(accessor, shape)?;
        match elements.component {
            ComponentType::U32 => Err(format!("accessor {accessor} holds U32, not f32")),
            other if N > 4 && other != ComponentType::F32 => {
                Err(format!("accessor {accessor} holds {other:?}, not f32"))
            }
            _ => Ok(Vectors(elements)),
        }
    }

    /// How many elements an accessor has; 0 where it can't be read.
    pub fn count(&self, accessor: usize) -> usize {
        let shape = self.root.accessors.get(accessor).map(|a| a.type_);
        let Some(Checked::Valid(shape)) = shape else { return 0 };
        self.elements(accessor, shape).map_or(0, |elements| elements.count)
    }

    /// Whether an accessor is of vectors of three.
    pub fn is_vec3(&self, accessor: usize) -> bool {
        self.root.accessors.get(accessor).is_some_and(|a| a.type_ == Checked::Valid(Type::Vec3))
    }

    /// An accessor of vertex indices.
    pub fn indices(&self, accessor: usize) -> Result<ElementIndices<'_>, String> {
        let elements = self.elements(accessor, Type::Scalar)?;
        match elements.component {
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => Ok(ElementIndices(elements)),
            other => Err(format!("accessor {accessor} holds {other:?}, not unsigned integers")),
        }
    }

    /// The bytes of a buffer view.
    pub fn view(&self, view: usize) -> Result<&[u8], String> {
        let found = self.root.buffer_views.get(view).ok_or_else(|| format!("there is no buffer view {view}"))?;
        if let Some(decoded) = self.decoded.views.get(&view) {
            return Ok(decoded);
        }
        let buffer = found.buffer.value();
        let bytes = self.buffer(buffer).ok_or_else(|| format!("buffer view {view}: there is no buffer {buffer}"))?;
        let start = found.byte_offset.map_or(Some(0), |o| usize::try_from(o.0).ok());
        let length = usize::try_from(found.byte_length.0).ok();
        start
            .zip(length)
            .and_then(|(start, length)| bytes.get(start..start.checked_add(length)?))
            .ok_or_else(|| format!("buffer view {view} reaches past its buffer of {} bytes", bytes.len()))
    }

    /// Some bytes of a buffer.
    pub fn buffer_part(&self, buffer: usize, start: usize, length: usize) -> Option<&[u8]> {
        self.buffer(buffer)?.get(start..start.checked_add(length)?)
    }

    fn buffer(&self, index: usize) -> Option<&[u8]> {
        self.buffers.get(index)?.as_ref().map(BufferBytes::bytes)
    }

    fn elements(&self, index: usize, shape: Type) -> Result<Elements<'_>, String> {
        let accessor = self.root.accessors.get(index).ok_or_else(|| format!("there is no accessor {index}"))?;
        self.checked_elements(index, accessor, shape).map_err(|why| format!("accessor {index} {why}"))
    }

    fn checked_elements(&self, index: usize, accessor: &Accessor, shape: Type) -> Result<Elements<'_>, String> {
        let Checked::Valid(found) = accessor.type_ else { return Err("has an unknown type".into()) };
        if found != shape {
            return Err(format!("holds {found:?}, not {shape:?}"));
        }
        let Checked::Valid(component) = accessor.component_type else {
            return Err("has an unknown component type".into());
        };
        let component = component.0;
        let size = component.size() * shape.multiplicity();
        let normalized = accessor.normalized;
        if let Some(bytes) = self.decoded.accessors.get(&index) {
            return Ok(Elements { bytes, stride: size, size, count: bytes.len() / size, component, normalized });
        }
        if accessor.sparse.is_some() {
            return Err("is sparse, and can't be filled in".into());
        }
        self.dense(accessor, component, size)
    }

    /// The elements of an accessor as its buffer view holds them.
    fn dense(&self, accessor: &Accessor, component: ComponentType, size: usize) -> Result<Elements<'_>, String> {
        let view_index = accessor.buffer_view.ok_or("has no buffer view")?.value();
        let view = self.view(view_index)?;
        let stride = self.root.buffer_views.get(view_index).and_then(|v| v.byte_stride).map_or(size, |s| s.0);
        if stride < size {
            return Err(format!("has elements of {size} bytes, {stride} bytes apart"));
        }
        let past = || {
            let (count, length) = (accessor.count.0, view.len());
            format!("of {count} elements reaches past its buffer view of {length} bytes")
        };
        let offset = usize::try_from(accessor.byte_offset.map_or(0, |o| o.0)).map_err(|_| past())?;
        let count = usize::try_from(accessor.count.0).map_err(|_| past())?;
        let bytes = view.get(offset..).ok_or_else(past)?;
        if let Some(last) = count.checked_sub(1) {
            let end = last.checked_mul(stride).and_then(|start| start.checked_add(size)).ok_or_else(past)?;
            if end > bytes.len() {
                return Err(past());
            }
        }
        Ok(Elements { bytes, stride, size, count, component, normalized: accessor.normalized })
    }

    /// The elements of a sparse accessor one behind the other, without what is sparse in it; zeros where it has no
    /// buffer view. `left`: how many more bytes there may be.
    pub(super) fn packed(
        &self,
        accessor: &Accessor,
        component: ComponentType,
        size: usize,
        left: &mut usize,
    ) -> Result<Vec<u8>, String> {
        let count = usize::try_from(accessor.count.0).ok().and_then(|count| count.checked_mul(size));
        let bytes = count
            .filter(|bytes| *bytes <= MAX_ZEROS)
            .ok_or_else(|| format!("of {} elements takes more than {} MiB", accessor.count.0, MAX_ZEROS >> 20))?;
        *left = left
            .checked_sub(bytes)
            .ok_or_else(|| format!("all sparse accessors together take more than {} MiB", MAX_DECODED >> 20))?;
        if accessor.buffer_view.is_none() {
            return Ok(vec![0; bytes]);
        }
        Ok(self.dense(accessor, component, size)?.iter().flatten().copied().collect())
    }
}

/// Bytes of an accessor that no buffer need hold.
const MAX_ZEROS: usize = 256 << 20;

impl<'d> Elements<'d> {
    fn iter(self) -> impl Iterator<Item = &'d [u8]> {
        self.bytes.chunks(self.stride).take(self.count).map(move |c| &c[..self.size])
    }

    /// The element of a place below its count.
    fn get(self, place: usize) -> &'d [u8] {
        &self.bytes[place * self.stride..][..self.size]
    }
}

impl ElementIndices<'_> {
    pub fn len(self) -> usize {
        self.0.count
    }

    /// The index of a place below [`ElementIndices::len`].
    pub fn get(self, place: usize) -> u32 {
        let e = self.0.get(place);
        match self.0.component {
            ComponentType::U8 => e[0].into(),
            ComponentType::U16 => u16::from_le_bytes([e[0], e[1]]).into(),
            _ => u32::from_le_bytes([e[0], e[1], e[2], e[3]]),
        }
    }
}

impl<'d, const N: usize> Vectors<'d, N> {
    pub fn len(self) -> usize {
        self.0.count
    }

    /// The vector of a place below [`Vectors::len`].
    pub fn get(self, place: usize) -> [f32; N] {
        self.decoded(self.0.get(place))
    }

    pub fn iter(self) -> impl Iterator<Item = [f32; N]> + use<'d, N> {
        self.0.iter().map(move |e| self.decoded(e))
    }

    fn decoded(self, e: &[u8]) -> [f32; N] {
        // Source of the scales: glTF 2.0, section 3.11, "Accessor Data Types".
        let scaled = |x: f32, most: f32| if self.0.normalized { (x / most).max(-1.0) } else { x };
        std::array::from_fn(|i| match self.0.component {
            ComponentType::U8 => scaled(e[i].into(), 255.0),
            ComponentType::I8 => scaled(i8::from_le_bytes([e[i]]).into(), 127.0),
            ComponentType::U16 => scaled(u16::from_le_bytes([e[2 * i], e[2 * i + 1]]).into(), 65535.0),
            ComponentType::I16 => scaled(i16::from_le_bytes([e[2 * i], e[2 * i + 1]]).into(), 32767.0),
            _ => f32::from_le_bytes([e[4 * i], e[4 * i + 1], e[4 * i + 2], e[4 * i + 3]]),
        })
    }
}

/// `kind[index] "name"`.
pub(super) fn place(kind: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("{kind}[{index}] \"{}\"", short(name)),
        None => format!("{kind}[{index}]"),
    }
}

/// The JSON and, of a GLB, the binary chunk. Source: glTF 2.0 specification, section 4, "GLB File Format
/// Specification".
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    const CUT: &str = "the GLB is cut off";
    if !bytes.starts_with(b"glTF") {
        let head = bytes.iter().find(|b| !b.is_ascii_whitespace());
        return match head {
            Some(b'{') => Ok((bytes, None)),
            Some(_) => Err("neither a GLB (which starts with `glTF`) nor glTF JSON (which starts with `{`)".into()),
            None => Err("the file is empty".into()),
        };
    }
    let version = word(bytes, 4).ok_or(CUT)?;
    if version != 2 {
        return Err(format!("GLB version {version}; only version 2 is supported"));
    }
    let length = word(bytes, 8).ok_or(CUT)?;
    let whole = bytes
        .get(..length as usize)
        .ok_or_else(|| format!("{CUT}: it should hold {length} bytes but has {}", bytes.len()))?;
    let (json, rest) = chunk(whole.get(12..).ok_or(CUT)?, b"JSON").ok_or("the GLB has no whole JSON chunk")?;
    if rest.is_empty() {
        return Ok((json, None));
    }
    let (binary, _) = chunk(rest, b"BIN\0").ok_or("the GLB's second chunk is no whole binary chunk")?;
    Ok((json, Some(binary)))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let b = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// The content of a chunk of this kind at the start of `bytes`, and what follows it.
fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let length = word(bytes, 0)? as usize;
    if bytes.get(4..8)? != kind {
        return None;
    }
    bytes.get(8..)?.split_at_checked(length)
}

pub(super) fn json_fault(json: &[u8], shown: &str, e: &gltf::json::Error) -> Diagnostic {
    let d = Diagnostic::error(format!("{shown}: not valid glTF JSON: {e}"));
    let Ok(text) = std::str::from_utf8(json) else { return d };
    // Minified files have one line of megabytes: the line and column in the message must do there.
    if text.lines().nth(e.line().saturating_sub(1)).is_none_or(|line| line.len() > 200) {
        return d;
    }
    let before: usize = text.split_inclusive('\n').take(e.line().saturating_sub(1)).map(str::len).sum();
    let at = (before + e.column().saturating_sub(1)).min(text.len());
    d.at(&Span::new(&Source::new(shown, text), at..at + 1), "")
}
