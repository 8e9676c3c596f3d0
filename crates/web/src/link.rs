//! What a link carries behind its `#`: the graph, the scene, parameters, the view and the files that were edited.
//! Compressed, in the letters of URLs. A link comes from anybody: whatever stands in it, reading takes bounded time and
//! memory, and what it gives is names and texts.

use miniz_oxide::deflate::compress_to_vec;
use miniz_oxide::inflate::decompress_to_vec_with_limit;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Characters of a link at most.
pub const MOST_CHARACTERS: usize = 1 << 20;

/// Bytes of what it holds at most, unpacked.
pub const MOST_BYTES: usize = 4 << 20;

/// Files and parameters at most.
const MOST_ENTRIES: usize = 256;

/// Characters of a path, a name or a value at most.
const MOST_NAME: usize = 256;

/// How strongly a link is compressed: the most that pays.
const LEVEL: u8 = 9;

/// What somebody shares.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedLink {
    /// Path of the graph in the project.
    pub graph: String,
    pub scene: String,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub params: BTreeMap<String, String>,
    /// Position, forward and up of the view; `None`: the scene's camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[[f32; 3]; 3]>,
    /// In stops.
    #[serde(default)]
    pub exposure: f32,
    /// By path: texts in place of those that the page comes with.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub files: BTreeMap<String, String>,
}

/// The link's letters for JSON of a [`Shared`].
///
/// # Errors
/// It is none, or too much for a link.
pub fn encode(json: &str) -> Result<String, String> {
    let shared = read(json)?;
    let text = serde_json::to_string(&shared).map_err(|e| e.to_string())?;
    if text.len() > MOST_BYTES {
        return Err(format!("a link holds at most {} MiB", MOST_BYTES >> 20));
    }
    let letters = letters(&compress_to_vec(text.as_bytes(), LEVEL));
    if letters.len() > MOST_CHARACTERS {
        Err("this is too much for a link: save it as files".into())
    } else {
        Ok(letters)
    }
}

/// What a link holds, as JSON of a [`Shared`].
///
/// # Errors
/// Why the link can't be followed.
pub fn decode(link: &str) -> Result<String, String> {
    if link.len() > MOST_CHARACTERS {
        return Err("the link is too long".into());
    }
    let bytes = bytes(link).ok_or("the link holds letters that no link has, or is cut off")?;
    let text = decompress_to_vec_with_limit(&bytes, MOST_BYTES).map_err(|_| "the link is damaged or holds too much")?;
    let text = String::from_utf8(text).map_err(|_| "the link holds no text")?;
    serde_json::to_string(&read(&text)?).map_err(|e| e.to_string())
}

fn read(json: &str) -> Result<SharedLink, String> {
    let shared: SharedLink = serde_json::from_str(json).map_err(|e| format!("the link holds something else: {e}"))?;
    check(&shared)?;
    Ok(shared)
}

fn check(shared: &SharedLink) -> Result<(), String> {
    if shared.files.len() > MOST_ENTRIES || shared.params.len() > MOST_ENTRIES {
        return Err(format!("a link holds at most {MOST_ENTRIES} files and parameters"));
    }
    let paths = shared.files.keys().chain([&shared.graph, &shared.scene]);
    if let Some(path) = paths.into_iter().find(|path| !is_ours(path)) {
        let shown: String = path.chars().take(80).collect();
        return Err(format!("the link names {shown:?}, which is no file of a project"));
    }
    if shared.params.iter().any(|(name, value)| name.len() > MOST_NAME || value.len() > MOST_NAME) {
        return Err("a parameter in the link is too long".into());
    }
    let numbers = shared.place.iter().flatten().flatten().chain([&shared.exposure]);
    if numbers.into_iter().any(|n| !n.is_finite() || n.abs() > 1e6) {
        return Err("the link's view is nowhere".into());
    }
    Ok(())
}

/// Whether a path names a graph, shader or scene in a folder of a project.
fn is_ours(path: &str) -> bool {
    let folder = ["graphs/", "shaders/", "scenes/"].iter().any(|folder| path.starts_with(folder));
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./ ".contains(c);
    let parts = path.split('/').all(|part| !part.is_empty() && part != "." && part != "..");
    folder && parts && path.len() <= MOST_NAME && path.chars().all(plain)
}

const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// Base 64 for URLs (RFC 4648, section 5), without padding.
fn letters(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for part in bytes.chunks(3) {
        let word = part.iter().fold(0u32, |word, byte| word << 8 | u32::from(*byte)) << (8 * (3 - part.len()));
        for i in 0..=part.len() {
            out.push(char::from(LETTERS[(word >> (18 - 6 * i)) as usize & 63]));
        }
    }
    out
}

fn bytes(letters: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(letters.len() / 4 * 3 + 2);
    for part in letters.as_bytes().chunks(4) {
        let mut word = 0u32;
        for letter in part {
            word = word << 6 | LETTERS.iter().position(|l| l == letter)? as u32;
        }
        let count = match part.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        out.extend((word << (6 * (4 - part.len()))).to_be_bytes()[1..].iter().take(count));
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARED: &str = r#"{"graph":"graphs/direct.ron","scene":"scenes/cornell.glb","params":{"bounces":"2"},
        "place":[[0,1,2],[0,0,-1],[0,1,0]],"exposure":0.5,"files":{"shaders/a.wgsl":"fn f() {} // <script>ä</script>"}}"#;

    #[test]
    fn a_link_gives_what_was_shared() {
        let link = encode(SHARED).unwrap();
        assert!(link.bytes().all(|b| LETTERS.contains(&b)), "{link}");
        let again: SharedLink = serde_json::from_str(&decode(&link).unwrap()).unwrap();
        assert_eq!(again, serde_json::from_str(SHARED).unwrap());
        assert_eq!(encode(&decode(&link).unwrap()).unwrap(), link);
    }

    #[test]
    fn letters_and_bytes_are_each_other_s_inverse() {
        for length in 0..70u8 {
            let all: Vec<u8> = (0..length).map(|i| i.wrapping_mul(37) ^ length).collect();
            assert_eq!(bytes(&letters(&all)), Some(all));
        }
        assert_eq!(letters(b"\xfb\xff\xfe"), "-__-");
        assert_eq!((bytes("A"), bytes("AA=="), bytes("é")), (None, None, None));
    }

    #[test]
    fn paths_lead_nowhere_else() {
        for path in
            ["graphs/../x.ron", "/graphs/a.ron", "graphs//a.ron", "javascript:alert(1)", "graphs/<b>", "other/a", ""]
        {
            let json = SHARED.replace("graphs/direct.ron", path);
            assert!(encode(&json).unwrap_err().contains("no file of a project"), "{path}");
        }
    }

    #[test]
    fn a_small_link_does_not_become_large() {
        let bomb = letters(&compress_to_vec(&vec![b' '; 64 << 20], LEVEL));
        assert!(bomb.len() < MOST_CHARACTERS);
        assert_eq!(decode(&bomb).unwrap_err(), "the link is damaged or holds too much");
        assert_eq!(decode(&"A".repeat(MOST_CHARACTERS + 1)).unwrap_err(), "the link is too long");
    }

    #[test]
    fn nested_and_unknown_things_are_refused() {
        let deep = format!("{{\"graph\":{}", "[".repeat(1 << 16));
        assert!(decode(&letters(&compress_to_vec(deep.as_bytes(), LEVEL))).is_err());
        assert!(encode(&SHARED.replace("exposure", "run")).unwrap_err().contains("unknown field"));
        assert!(encode(&SHARED.replace("0.5", "1e30")).unwrap_err().contains("nowhere"));
    }

    /// Links that are nearly right, and links of nothing. `LIGHTGRAPH_LINKS` says how many; a million take half a
    /// minute.
    #[test]
    fn no_link_panics() {
        let count = std::env::var("LIGHTGRAPH_LINKS").map_or(20_000, |n| n.parse().unwrap());
        let good = encode(SHARED).unwrap().into_bytes();
        let text = SHARED.as_bytes();
        let mut state = 0x9e37_79b9_7f4a_7c15u64;
        let mut random = |below: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % below as u64) as usize
        };
        let mut read = 0;
        for round in 0..count {
            let mut link = if round % 2 == 0 { good.clone() } else { text.to_vec() };
            for _ in 0..=random(4) {
                let at = random(link.len().max(1));
                if link.is_empty() {
                    break;
                }
                match random(4) {
                    0 => link[at] = random(256) as u8,
                    1 => drop(link.remove(at)),
                    2 => link.insert(at, LETTERS[random(64)]),
                    _ => link.truncate(at.max(1)),
                }
            }
            // Half of them are spoilt after they were packed, and half before.
            let link = match round % 2 {
                0 => String::from_utf8_lossy(&link).into_owned(),
                _ => letters(&compress_to_vec(&link, 1)),
            };
            if let Ok(json) = decode(&link) {
                read += 1;
                assert!(check(&serde_json::from_str(&json).unwrap()).is_ok());
            }
        }
        assert!(read > 0 && read < count, "{read} of {count} could be read");
    }
}
