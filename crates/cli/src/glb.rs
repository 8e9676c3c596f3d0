//! Generated glTF as one file.

/// glTF's binary container: a header, then a chunk each of JSON and of bytes.
pub fn glb(json: &str, bytes: &[u8]) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let word = |n: usize| u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes();
    let total = 12 + 8 + text.len() + 8 + bytes.len();
    let parts: [&[u8]; 9] =
        [b"glTF", &word(2), &word(total), &word(text.len()), b"JSON", &text, &word(bytes.len()), b"BIN\0", &bytes];
    parts.concat()
}
