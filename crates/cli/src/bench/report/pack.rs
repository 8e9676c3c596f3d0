//! A page's data, small: rows as columns, texts once, compressed, as letters. `unpack.js` is its opposite.

use crate::base64::base64;
use flate2::{Compression, write::ZlibEncoder};
use lightgraph::{Checked, Diagnostic};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

/// Five digits, two more than a page shows, so that what it reckons with them is right too; whole numbers from ten
/// thousand up. What isn't finite is no number.
pub fn number(x: f64) -> Value {
    let rounded = if x.abs() >= 1e4 { x.round() } else { format!("{x:.4e}").parse().unwrap_or(x) };
    // `3` is shorter than `3.0`.
    if rounded.fract() == 0.0 && rounded.abs() < 1e15 { json!(rounded as i64) } else { json!(rounded) }
}

/// The page with the entries of each scene as columns, compressed.
///
/// # Errors
/// Data that makes no JSON, a fault of this program.
pub fn pack(mut page: Value) -> Checked<String> {
    let mut words = TextTable::default();
    for scene in page["scenes"].as_array_mut().into_iter().flatten() {
        if let Value::Array(rows) = scene["entries"].take() {
            let packed = columns(&rows.iter().map(Some).collect::<Vec<_>>(), &mut words);
            scene["entries"] = json!({ "count": rows.len(), "columns": packed });
        }
    }
    page["words"] = Value::Array(words.all);
    let fault = |e: &dyn std::fmt::Display| Diagnostic::error(format!("can't write the report: {e}"));
    let json = serde_json::to_vec(&page).map_err(|e| fault(&e))?;
    let mut encoder = ZlibEncoder::new(vec![], Compression::best());
    encoder.write_all(&json).map_err(|e| fault(&e))?;
    Ok(base64(&encoder.finish().map_err(|e| fault(&e))?))
}

/// Texts and lists of texts, each once.
#[derive(Default)]
struct TextTable {
    all: Vec<Value>,
    places: BTreeMap<String, usize>,
}

impl TextTable {
    fn place(&mut self, word: &Value) -> usize {
        *self.places.entry(word.to_string()).or_insert_with(|| {
            self.all.push(word.clone());
            self.all.len() - 1
        })
    }
}

/// `["rows", {name: columns}]`, `["words", [places in the words]]` or `["values", [anything]]`. Absent and null are the
/// same.
fn columns(rows: &[Option<&Value>], words: &mut TextTable) -> Value {
    let all = |fits: fn(&Value) -> bool| rows.iter().flatten().all(|v| fits(v));
    if all(Value::is_object) {
        let keys: BTreeSet<&String> = rows.iter().flatten().filter_map(|v| v.as_object()).flat_map(Map::keys).collect();
        let mut packed = Map::new();
        for key in keys {
            let column: Vec<_> = rows.iter().map(|r| r.and_then(|v| v.get(key)).filter(|v| !v.is_null())).collect();
            if column.iter().any(Option::is_some) {
                packed.insert(key.clone(), columns(&column, words));
            }
        }
        return json!(["rows", packed]);
    }
    let wordy = |v: &Value| v.is_string() || v.as_array().is_some_and(|a| a.iter().all(Value::is_string));
    if all(wordy) {
        let places: Vec<_> = rows.iter().map(|r| r.map(|v| words.place(v))).collect();
        return json!(["words", places]);
    }
    json!(["values", rows])
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use flate2::read::ZlibDecoder;
    use std::io::Read;

    /// What [`pack`] was given but for columns.
    pub fn inflated(text: &str) -> Value {
        let digit = |c: u8| match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            _ => 63,
        };
        let letters: Vec<u8> = text.trim_end_matches('=').bytes().map(digit).collect();
        let bytes = letters.chunks(4).flat_map(|four| {
            let bits = (0..4).fold(0, |bits, i| bits << 6 | u32::from(four.get(i).copied().unwrap_or(0)));
            bits.to_be_bytes().into_iter().skip(1).take(four.len() - 1)
        });
        let (bytes, mut json) = (bytes.collect::<Vec<u8>>(), vec![]);
        ZlibDecoder::new(bytes.as_slice()).read_to_end(&mut json).unwrap();
        serde_json::from_slice(&json).unwrap()
    }

    #[test]
    fn numbers_keep_five_digits() {
        let cases =
            [(0.0, "0"), (12.345_67, "12.346"), (-0.012_345_67, "-0.012346"), (98_765.4, "98765"), (3.000_01, "3")];
        for (x, text) in cases {
            assert_eq!(number(x).to_string(), text);
        }
        assert_eq!(number(f64::NAN), Value::Null);
    }

    #[test]
    fn rows_become_columns_and_texts_stand_once() {
        let rows = json!([
            {"name": "a", "ms": {"first": {"wall": 1, "steps": ["x", "y"]}}, "sums": [1, 2], "none": null},
            {"name": "b", "ms": {}, "sums": [3]},
            {"name": "a", "ms": {"first": {"wall": 2, "steps": ["x", "y"]}}},
        ]);
        let page = inflated(&pack(json!({"title": "t", "scenes": [{"label": "l", "entries": rows}]})).unwrap());
        let columns = json!(["rows", {
            "ms": ["rows", {"first": ["rows", {"steps": ["words", [0, null, 0]], "wall": ["values", [1, null, 2]]}]}],
            "name": ["words", [1, 2, 1]],
            "sums": ["values", [[1, 2], [3], null]],
        }]);
        let scene = json!({"label": "l", "entries": {"count": 3, "columns": columns}});
        assert_eq!(page, json!({"title": "t", "scenes": [scene], "words": [["x", "y"], "a", "b"]}));
    }
}
