//! Parses the scene RON; the parent module's documentation describes the format.
//!
//! The text is parsed in layers, so that each entry's fault is found and has its place.

use super::{
    added::{AddedCamera, AddedEnvironment, AddedLight},
    keyed::KeyedParam,
    model::Bounds,
};
use crate::diag::{Diagnostic, Source, Span};
use crate::files;
use glam::Vec3;
use ron::{error::SpannedError, extensions::Extensions, value::RawValue};
use rustc_hash::FxHashMap;
use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, MapAccess, Visitor},
};
use std::{collections::hash_map::Entry, fmt, path::Path, sync::Arc};

/// A parsed scene RON. Names are not yet looked up.
#[derive(Debug)]
pub(super) struct Description {
    pub gltf: Option<Located<String>>,
    pub grid: Option<Bounds>,
    pub materials: Vec<(Located<String>, Finish)>,
    pub motion: Vec<(Located<String>, Vec<KeyframeText>)>,
    pub params: Vec<KeyedParam>,
    pub camera: Option<Located<String>>,
    pub lights: Vec<(Located<String>, AddedLight)>,
    pub cameras: Vec<(Located<String>, AddedCamera)>,
    pub environment: Option<Located<AddedEnvironment>>,
    /// Whether a scene without light gets some.
    pub default_light: bool,
}

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(super) struct Located<T> {
    pub value: T,
    pub span: Span,
}

/// The Phong lobe of a material.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Finish {
    #[serde(default)]
    pub specular: f32,
    #[serde(default = "matt")]
    pub shininess: f32,
}

/// A keyframe as written.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KeyframeText {
    pub time: f32,
    #[serde(default)]
    pub translation: Option<[f32; 3]>,
    #[serde(default)]
    pub rotation_degrees: Option<[f32; 4]>,
}

/// A keyframe of a parameter as written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParamKeyText {
    time: f32,
    value: String,
}

#[derive(Default, Deserialize)]
#[serde(rename = "Scene", deny_unknown_fields)]
struct Top<'a> {
    #[serde(borrow, default)]
    gltf: Option<&'a RawValue>,
    #[serde(borrow, default)]
    grid: Option<&'a RawValue>,
    #[serde(borrow, default)]
    materials: Option<&'a RawValue>,
    #[serde(borrow, default)]
    motion: Option<&'a RawValue>,
    #[serde(borrow, default)]
    params: Option<&'a RawValue>,
    #[serde(borrow, default)]
    camera: Option<&'a RawValue>,
    #[serde(borrow, default)]
    lights: Option<&'a RawValue>,
    #[serde(borrow, default)]
    cameras: Option<&'a RawValue>,
    #[serde(borrow, default)]
    environment: Option<&'a RawValue>,
    #[serde(borrow, default)]
    default_light: Option<&'a RawValue>,
}

/// A map in the order of the text.
struct Entries<'a>(Vec<(&'a RawValue, &'a RawValue)>);

/// Parses a scene RON. What is faulty is left out of the result.
pub(super) fn parse(source: &Arc<Source>, faults: &mut Vec<Diagnostic>) -> Description {
    let mut parser = SceneParser { source, faults };
    let top = match options().from_str::<Top<'_>>(&source.text) {
        Ok(top) => top,
        Err(e) => {
            parser.fault(0, &source.text, &e);
            Top::default()
        }
    };
    Description {
        gltf: top.gltf.and_then(|raw| parser.value(raw)),
        grid: top.grid.and_then(|raw| parser.value(raw)).and_then(|grid| parser.grid(&grid)),
        materials: parser.materials(top.materials),
        motion: parser.motion(top.motion),
        params: parser.params(top.params),
        camera: top.camera.and_then(|raw| parser.value(raw)),
        lights: parser.checked(top.lights, AddedLight::check),
        cameras: parser.checked(top.cameras, AddedCamera::check),
        environment: top.environment.and_then(|raw| parser.environment(raw)),
        default_light: top.default_light.and_then(|raw| parser.value(raw)).is_none_or(|d| d.value),
    }
}

struct SceneParser<'a> {
    source: &'a Arc<Source>,
    faults: &'a mut Vec<Diagnostic>,
}

impl SceneParser<'_> {
    fn grid(&mut self, grid: &Located<([f32; 3], [f32; 3])>) -> Option<Bounds> {
        let bounds = Bounds { min: grid.value.0.into(), max: grid.value.1.into() };
        let sound = bounds.min.is_finite() && bounds.max.is_finite() && bounds.min.cmplt(bounds.max).all();
        if !sound {
            let d = Diagnostic::error("the first corner of `grid` must lie below the second on every axis");
            self.faults.push(d.at(&grid.span, "").help("write the corners as ((min x, y, z), (max x, y, z))"));
        }
        sound.then_some(bounds)
    }

    fn materials(&mut self, raw: Option<&RawValue>) -> Vec<(Located<String>, Finish)> {
        let mut all = vec![];
        for (name, finish) in self.entries::<Finish>(raw) {
            let Finish { specular, shininess } = finish.value;
            if !(0.0..=1.0).contains(&specular) {
                let d = Diagnostic::error(format!("`specular` of \"{}\" is {specular}, not within 0 to 1", name.value));
                self.faults.push(d.at(&finish.span, ""));
            } else if !(shininess > 0.0 && shininess.is_finite()) {
                let d = Diagnostic::error(format!(
                    "`shininess` of \"{}\" is {shininess}, not a positive number",
                    name.value
                ));
                self.faults.push(d.at(&finish.span, ""));
            } else {
                all.push((name, finish.value));
            }
        }
        all
    }

    fn motion(&mut self, raw: Option<&RawValue>) -> Vec<(Located<String>, Vec<KeyframeText>)> {
        let mut all = vec![];
        for (name, keys) in self.entries::<Vec<KeyframeText>>(raw) {
            match keys_fault(&keys.value) {
                Some((why, help)) => {
                    let d = Diagnostic::error(format!("motion of \"{}\": {why}", name.value));
                    self.faults.push(d.at(&keys.span, "").help(help));
                }
                None => all.push((name, keys.value)),
            }
        }
        all
    }

    fn params(&mut self, raw: Option<&RawValue>) -> Vec<KeyedParam> {
        let mut all = vec![];
        for (name, keys) in self.entries::<Vec<ParamKeyText>>(raw) {
            let times: Vec<f32> = keys.value.iter().map(|k| k.time).collect();
            match times_fault(&times, "(time: 0, value: \"1.5\")") {
                Some((why, help)) => {
                    let d = Diagnostic::error(format!("parameter \"{}\": {why}", name.value));
                    self.faults.push(d.at(&keys.span, "").help(help));
                }
                None => {
                    let texts = keys.value.into_iter().map(|k| (k.time, k.value)).collect();
                    all.push(KeyedParam { name: name.value, keys: texts, span: keys.span });
                }
            }
        }
        all
    }

    /// Entries whose numbers pass.
    fn checked<T: DeserializeOwned>(
        &mut self,
        raw: Option<&RawValue>,
        check: impl Fn(&T) -> Result<(), String>,
    ) -> Vec<(Located<String>, T)> {
        let mut all = vec![];
        for (name, entry) in self.entries::<T>(raw) {
            match check(&entry.value) {
                Ok(()) => all.push((name, entry.value)),
                Err(why) => {
                    self.faults.push(Diagnostic::error(format!("\"{}\": {why}", name.value)).at(&entry.span, ""))
                }
            }
        }
        all
    }

    /// Its file lies beside the scene file.
    fn environment(&mut self, raw: &RawValue) -> Option<Located<AddedEnvironment>> {
        let mut found = self.value::<AddedEnvironment>(raw)?;
        if let AddedEnvironment::File { file, .. } = &mut found.value {
            let folder = Path::new(&self.source.path).parent().unwrap_or(Path::new(""));
            let named = file.to_string_lossy().into_owned();
            match files::inside(folder, &named) {
                Ok(path) => *file = path,
                Err(why) => {
                    let d = Diagnostic::error(format!("environment: `{named}` {why}")).at(&found.span, "");
                    self.faults.push(d);
                    return None;
                }
            }
        }
        let checked = found.value.check();
        checked
            .map_err(|why| self.faults.push(Diagnostic::error(format!("environment: {why}")).at(&found.span, "")))
            .ok()?;
        Some(found)
    }

    /// The entries of a map, each parsed by itself; a name may stand once.
    fn entries<T: DeserializeOwned>(&mut self, raw: Option<&RawValue>) -> Vec<(Located<String>, Located<T>)> {
        let Some(raw) = raw else { return vec![] };
        let (at, text) = self.place(raw);
        let entries = match options().from_str::<Entries<'_>>(text) {
            Ok(entries) => entries.0,
            Err(e) => {
                self.fault(at, text, &e);
                return vec![];
            }
        };
        let mut all: Vec<(Located<String>, Located<T>)> = vec![];
        let mut places: FxHashMap<String, usize> = FxHashMap::default();
        for (key, value) in entries {
            let (Some(key), Some(value)) = (self.value::<String>(key), self.value::<T>(value)) else { continue };
            match places.entry(key.value.clone()) {
                Entry::Occupied(first) => {
                    let first = &all[*first.get()].0;
                    let d = Diagnostic::error(format!("\"{}\" stands twice", key.value));
                    self.faults.push(d.at(&key.span, "").at(&first.span, "first here").help("remove one of the two"));
                }
                Entry::Vacant(place) => {
                    place.insert(all.len());
                    all.push((key, value));
                }
            }
        }
        all
    }

    fn value<T: DeserializeOwned>(&mut self, raw: &RawValue) -> Option<Located<T>> {
        let (at, text) = self.place(raw);
        match options().from_str(text) {
            Ok(value) => Some(Located { value, span: Span::new(self.source, at..at + text.len()) }),
            Err(e) => {
                self.fault(at, text, &e);
                None
            }
        }
    }

    /// Offset in the source, and the text without the space round it.
    fn place<'r>(&self, raw: &'r RawValue) -> (usize, &'r str) {
        let text = raw.get_ron().trim();
        // A raw value borrows from the source, so the distance between the two is its offset.
        let at = (text.as_ptr() as usize).saturating_sub(self.source.text.as_ptr() as usize);
        (at.min(self.source.text.len()), text)
    }

    fn fault(&mut self, at: usize, text: &str, e: &SpannedError) {
        use ron::Error as Code;
        let offset = |p: ron::error::Position| {
            let before: usize = text.split_inclusive('\n').take(p.line.saturating_sub(1)).map(str::len).sum();
            let line = text.get(before..).unwrap_or("");
            let within: usize = line.chars().take(p.col.saturating_sub(1)).map(char::len_utf8).sum();
            at + before + within
        };
        let span = Span::new(self.source, offset(e.span.start)..offset(e.span.end).max(offset(e.span.start) + 1));
        let d = match &e.code {
            Code::NoSuchStructField { expected, found, .. } => {
                let d = Diagnostic::error(format!("unknown key `{found}`")).nearest(found, expected.iter().copied());
                d.help(format!("the keys here are {}", expected.join(", ")))
            }
            Code::NoSuchEnumVariant { expected, found, .. } => {
                let d = Diagnostic::error(format!("unknown kind `{found}`")).nearest(found, expected.iter().copied());
                d.help(format!("the kinds here are {}", expected.join(", ")))
            }
            Code::MissingStructField { field, .. } => Diagnostic::error(format!("`{field}` is missing")),
            Code::DuplicateStructField { field, .. } => Diagnostic::error(format!("`{field}` stands twice")),
            code => Diagnostic::error(format!("not a valid scene file: {code}")),
        };
        self.faults.push(d.at(&span, ""));
    }
}

/// What is wrong with the times of keyframes, and the remedy.
fn times_fault(times: &[f32], example: &str) -> Option<(String, String)> {
    if times.is_empty() {
        return Some(("no keyframes".into(), format!("write at least one: {example}")));
    }
    if let Some(i) = times.iter().position(|t| t.abs() > super::geometry::MAX_COORDINATE || t.is_nan()) {
        return Some((format!("keyframe {i} has a number that is no usable one"), "write finite numbers".into()));
    }
    if times.iter().any(|t| *t < 0.0) || times.windows(2).any(|w| w[0] >= w[1]) {
        return Some(("times must not be negative and must grow".into(), "order the keyframes by time".into()));
    }
    None
}

/// What is wrong with a list of keyframes, and the remedy.
fn keys_fault(keys: &[KeyframeText]) -> Option<(String, String)> {
    let finite = |k: &KeyframeText| {
        let mut numbers = k.translation.iter().flatten().chain(k.rotation_degrees.iter().flatten());
        numbers.all(|x| x.abs() <= super::geometry::MAX_COORDINATE)
    };
    let times: Vec<f32> = keys.iter().map(|k| k.time).collect();
    if let Some(fault) = times_fault(&times, "(time: 0, translation: (0, 1, 0))") {
        return Some(fault);
    }
    if let Some(i) = keys.iter().position(|k| !finite(k)) {
        return Some((format!("keyframe {i} has a number that is no usable one"), "write finite numbers".into()));
    }
    let axis = |k: &KeyframeText| k.rotation_degrees.map(|[x, y, z, _]| Vec3::new(x, y, z));
    if let Some(i) = keys.iter().position(|k| axis(k).is_some_and(|a| a.try_normalize().is_none())) {
        return Some((format!("the rotation axis of keyframe {i} has no length"), "for example (0, 1, 0, 90)".into()));
    }
    None
}

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

fn matt() -> f32 {
    1.0
}

impl<'de: 'a, 'a> Deserialize<'de> for Entries<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> Visitor<'de> for InOrder {
            type Value = Entries<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map from names")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut all = vec![];
                while let Some(entry) = map.next_entry()? {
                    all.push(entry);
                }
                Ok(Entries(all))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults_of(text: &str) -> String {
        let mut faults = vec![];
        parse(&Source::new("hall.ron", text), &mut faults);
        crate::diag::render(&faults)
    }

    #[test]
    fn everything_a_scene_file_can_say_is_read() {
        let text = r#"Scene(
    gltf: "hall.glb", // beside this file
    grid: /* corners */ ((-4, 0, -4), (4, 3, 4)),
    // By the glTF's names.
    materials: { "floor": (specular: 0.4, shininess: 20), "wall": (specular: 0.1) },
    motion: { "lamp": [(time: 0, translation: (0, 2, 0)), (time: 4.5, rotation_degrees: (0, 1, 0, 90))] },
    camera: "overview",
)"#;
        let mut faults = vec![];
        let d = parse(&Source::new("hall.ron", text), &mut faults);
        assert_eq!(faults, []);
        assert_eq!(d.gltf.unwrap().value, "hall.glb");
        assert_eq!(d.grid.unwrap(), Bounds { min: Vec3::new(-4.0, 0.0, -4.0), max: Vec3::new(4.0, 3.0, 4.0) });
        assert_eq!(d.materials[0].0.value, "floor");
        assert_eq!(d.materials[0].1, Finish { specular: 0.4, shininess: 20.0 });
        assert_eq!(d.materials[1].1, Finish { specular: 0.1, shininess: 1.0 });
        assert_eq!(d.motion[0].0.span.text(), "\"lamp\"");
        let [first, second] = d.motion[0].1[..] else { panic!("{:?}", d.motion) };
        assert_eq!(first, KeyframeText { time: 0.0, translation: Some([0.0, 2.0, 0.0]), rotation_degrees: None });
        assert_eq!(
            second,
            KeyframeText { time: 4.5, translation: None, rotation_degrees: Some([0.0, 1.0, 0.0, 90.0]) }
        );
        assert_eq!(d.camera.unwrap().value, "overview");
        assert_eq!(faults_of("Scene()"), "");
    }

    #[test]
    fn an_unknown_key_names_the_nearest() {
        let text = faults_of("Scene(\n    materal: {},\n)");
        assert!(text.contains("hall.ron:2:5"), "{text}");
        assert!(text.contains("unknown key `materal`"), "{text}");
        assert!(text.contains("did you mean `materials`?"), "{text}");
    }

    #[test]
    fn every_bad_entry_is_reported_at_its_place() {
        let text = faults_of(
            r#"Scene(
    grid: ((0, 0, 0), (1, 0, 1)),
    materials: {
        "a": (specular: 2),
        "b": (speclar: 0.5),
        "c": (shininess: 0),
        "d": (specular: 0.1),
        "d": (specular: 0.2),
    },
    motion: {
        "e": [],
        "f": [(time: 1), (time: 1)],
        "g": [(time: 0, rotation_degrees: (0, 0, 0, 9))],
        "h": [(time: 0, translation: (0, NaN, 0))],
        "i": [(translation: (0, 0, 0))],
    },
    params: { "j": [], "k": [(time: 2, value: "1"), (time: 1, value: "2")], "l": [(time: 0, value: 1)] },
    camera: 3,
)"#,
        );
        for expected in [
            "hall.ron:2:11",
            "must lie below the second",
            "hall.ron:4:14",
            "`specular` of \"a\" is 2",
            "hall.ron:5:15",
            "did you mean `specular`?",
            "`shininess` of \"c\" is 0",
            "hall.ron:8:9",
            "\"d\" stands twice",
            "motion of \"e\": no keyframes",
            "motion of \"f\": times must not be negative and must grow",
            "the rotation axis of keyframe 0 has no length",
            "motion of \"h\": keyframe 0 has a number that is no usable one",
            "`time` is missing",
            "parameter \"j\": no keyframes",
            "parameter \"k\": times must not be negative and must grow",
            "hall.ron:17:99",
            "hall.ron:18:13",
        ] {
            assert!(text.contains(expected), "no {expected:?} in\n{text}");
        }
    }

    #[test]
    fn broken_ron_is_one_fault_with_its_place() {
        let text = faults_of("Scene(\n  grid: ((0, 0\n");
        assert!(text.contains("not a valid scene file"), "{text}");
        assert!(text.contains("hall.ron:"), "{text}");
        assert!(faults_of("").contains("not a valid scene file"));
        assert!(faults_of("Graph()").contains("not a valid scene file"));
        assert!(!faults_of(&"[".repeat(100_000)).is_empty());
    }
}
