//! Addresses of documents (`file:///a%20b.ron`) and paths.

use lsp_types::Uri;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, percent_decode_str, utf8_percent_encode};
use std::path::{Path, PathBuf};

/// What stands in an address as it is.
const KEPT: &AsciiSet = &NON_ALPHANUMERIC.remove(b'/').remove(b'-').remove(b'_').remove(b'.').remove(b'~');

/// The file of an address; `None` for documents that are no files.
pub fn path(uri: &Uri) -> Option<PathBuf> {
    let rest = uri.as_str().strip_prefix("file://")?;
    // What stands before the path is a host: this one.
    let path = &rest[rest.find('/')?..];
    let path = percent_decode_str(path).decode_utf8().ok()?;
    Some(PathBuf::from(drive(&path).unwrap_or(&path)))
}

/// `C:/a` of `/C:/a`, as addresses have it for Windows.
fn drive(path: &str) -> Option<&str> {
    let rest = path.strip_prefix('/')?;
    (cfg!(windows) && rest.as_bytes().get(1) == Some(&b':')).then_some(rest)
}

/// The address of a file; `None` for what can't be one, such as files that the program carries.
pub fn of(path: &Path) -> Option<Uri> {
    let text = path.to_str().filter(|_| path.is_absolute())?.replace('\\', "/");
    let slash = if text.starts_with('/') { "" } else { "/" };
    format!("file://{slash}{}", utf8_percent_encode(&text, KEPT)).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_come_back() {
        for name in ["/a/b.ron", "/a b/ü%20.wgsl", "/#?[]{}&"] {
            assert_eq!(path(&of(Path::new(name)).unwrap()).unwrap(), Path::new(name), "{name}");
        }
        assert_eq!(of(Path::new("lightgraph:graphs/a.ron")), None);
        assert_eq!(path(&"untitled:Untitled-1".parse().unwrap()), None);
        assert_eq!(path(&"file:///c%3A/a.ron".parse().unwrap()).unwrap(), Path::new("/c:/a.ron"));
    }
}
