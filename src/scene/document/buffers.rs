//! What a document's buffers and images name: parts of itself, and files beside it.

use super::{Document, decoded};
use crate::{diag::Diagnostic, files};
use std::{
    borrow::Cow,
    collections::BTreeMap,
    io::ErrorKind,
    path::{Path, PathBuf},
    sync::Arc,
};

/// The first bytes of what a buffer names; other buffers may name the same.
pub(super) struct BufferBytes<'a> {
    named: Arc<Cow<'a, [u8]>>,
    /// At most as many as there are.
    length: usize,
}

impl BufferBytes<'_> {
    pub fn bytes(&self) -> &[u8] {
        &self.named[..self.length]
    }
}

impl<'a> Document<'a> {
    /// The bytes behind a URI: base64 data, or a file beside the document.
    pub fn fetch(&self, uri: &str, files: &mut Vec<PathBuf>) -> Result<Vec<u8>, String> {
        self.fetch_up_to(uri, files::GEOMETRY, files)
    }

    fn fetch_up_to(&self, uri: &str, most: u64, files: &mut Vec<PathBuf>) -> Result<Vec<u8>, String> {
        if uri.starts_with("data:") {
            if !uri.contains(";base64,") {
                return Err("a data URI that is not base64".into());
            }
            // The crate pads the bytes to a multiple of four, which neither buffers nor images mind.
            return gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), None)
                .map(|data| data.0)
                .map_err(|e| format!("a data URI with broken base64: {e}"));
        }
        if uri.contains("://") || uri.starts_with("file:") {
            return Err(format!("`{uri}` is not a path relative to the file"));
        }
        let Some(directory) = &self.directory else {
            return Err(format!("`{uri}` is another file: bytes alone name none; put all into a .glb"));
        };
        let path = files::inside(directory, &percent_decoded(uri)?).map_err(|why| format!("`{uri}` {why}"))?;
        let bytes = read_up_to(&path, most)?;
        files.push(path);
        Ok(bytes)
    }

    pub(super) fn read_buffers(
        &self,
        blob: Option<&'a [u8]>,
        files: &mut Vec<PathBuf>,
        faults: &mut Vec<Diagnostic>,
    ) -> Vec<Option<BufferBytes<'a>>> {
        let mut all = vec![];
        let mut left = files::GEOMETRY;
        let mut read: BTreeMap<&str, Arc<Cow<'a, [u8]>>> = BTreeMap::new();
        for (i, buffer) in self.root.buffers.iter().enumerate() {
            // Stands for bytes that another buffer holds compressed.
            if buffer.uri.is_none() && decoded::is_fallback(buffer) {
                all.push(Some(BufferBytes { named: Arc::new(Cow::Borrowed(&[])), length: 0 }));
                continue;
            }
            let named = match &buffer.uri {
                Some(uri) => match read.get(uri.as_str()) {
                    Some(named) => Ok(named.clone()),
                    None => self.fetch_up_to(uri, left, files).map(|bytes| {
                        left = left.saturating_sub(bytes.len() as u64);
                        read.entry(uri).or_insert(Arc::new(Cow::Owned(bytes))).clone()
                    }),
                },
                None if i == 0 => {
                    let blob = blob.map(|blob| Arc::new(Cow::Borrowed(blob)));
                    blob.ok_or_else(|| "no URI, and the file has no binary chunk".into())
                }
                None => Err("no URI; only the first buffer may be the binary chunk".into()),
            };
            let place = format!("buffers[{i}]");
            let wanted = buffer.byte_length.0;
            let checked = match named {
                // What lies behind the declared length is padding, no part of the buffer.
                Ok(named) => match usize::try_from(wanted).ok().filter(|length| *length <= named.len()) {
                    Some(length) => Ok(BufferBytes { named, length }),
                    None => {
                        let why = format!("it should hold {wanted} bytes but has {}", named.len());
                        Err(self.error(place, why).help("the file is cut off: export or copy it again"))
                    }
                },
                Err(why) => Err(self.error(place, why)),
            };
            all.push(checked.map_err(|fault| faults.push(fault)).ok());
        }
        all
    }
}

/// All of a regular file; anything else might never end.
pub(in crate::internals::scene) fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    read_up_to(path, files::GEOMETRY)
}

fn read_up_to(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    files::read(path, most).map_err(|e| {
        let shared = most < files::GEOMETRY && e.kind() == ErrorKind::FileTooLarge;
        let besides = if shared { ", which is what other buffers leave" } else { "" };
        format!("can't read {}: {e}{besides}", path.display())
    })
}

fn percent_decoded(uri: &str) -> Result<String, String> {
    let mut bytes = vec![];
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        rest = tail;
        let escape =
            tail.get(..2).and_then(|d| std::str::from_utf8(d).ok()).and_then(|d| u8::from_str_radix(d, 16).ok());
        match (first, escape) {
            (b'%', Some(byte)) => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            _ => bytes.push(*first),
        }
    }
    String::from_utf8(bytes).map_err(|_| format!("`{uri}` does not decode to UTF-8"))
}
