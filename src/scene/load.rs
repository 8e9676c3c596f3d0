//! From a path to a scene: finds the files, joins the glTF and its scene RON.

use super::{
    added::Additions,
    clusters::cluster,
    complete,
    description::{self, Description, KeyframeText, Located},
    document::{Document, read_file},
    import::import,
    model::{Keyframe, Scene},
};
use crate::diag::{Checked, Diagnostic, Faults, Severity, Source};
use crate::files;
use glam::Vec3;
use rustc_hash::{FxHashMap, FxHashSet};
use std::{
    borrow::Cow,
    path::{Path, PathBuf},
    sync::Arc,
};

/// A scene, and what its user should know.
#[derive(Debug, Clone)]
pub struct Loaded {
    pub scene: Scene,
    /// Warnings and notes: what is ignored, dropped or made up.
    pub notices: Vec<Diagnostic>,
    /// All files that went into it, in the order they were read.
    pub files: Vec<PathBuf>,
}

impl Scene {
    /// Loads a scene from a `.gltf`, a `.glb`, a scene `.ron`, or a path without one of these endings: then the first
    /// of PATH.ron, PATH.glb and PATH.gltf that is there, or else of the same names inside the directory PATH.
    /// A glTF with a `.ron` of the same stem beside it uses it. A scene without light gets a sun and a sky, or a lamp
    /// where it is a closed room; a room without a camera gets one inside. Notices say so.
    ///
    /// # Errors
    /// Every fault of the files: what can't be read, is no glTF 2 or scene RON, or holds numbers, indices or names that
    /// nothing can be made of; and a scene without triangles.
    ///
    /// ```
    /// use lightgraph::Scene;
    /// use std::path::Path;
    ///
    /// let scene = Scene::load(Path::new("scenes/cornell.glb"))?.scene;
    /// assert_eq!(scene.cameras.len(), 1);
    /// # lightgraph::Checked::Ok(())
    /// ```
    pub fn load(path: &Path) -> Checked<Loaded> {
        Scene::load_with(path, &Additions::default())
    }

    /// As [`Scene::load`], with lights, cameras or an environment besides the files'.
    ///
    /// # Errors
    /// As [`Scene::load`], and an environment's file that can't be read.
    pub fn load_with(path: &Path, additions: &Additions) -> Checked<Loaded> {
        from_files(path, additions)
    }

    /// A triangle, a light and a camera, for graphs that need no scene: a plan that looks at it says so
    /// ([`crate::plan::tables::scene_use`]).
    ///
    /// # Errors
    /// None that a user could bring about.
    pub fn stand_in() -> Checked<Loaded> {
        let loaded = Scene::from_bytes(include_bytes!("stand_in.gltf"), "none", None)?;
        Ok(Loaded { notices: vec![], ..loaded })
    }

    /// A scene from the bytes of a `.gltf` or `.glb` that needs no other file, called `name`, and the text of a scene
    /// RON. Nothing is made up for it: without light it is dark.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn from_bytes(bytes: &[u8], name: &str, description: Option<&str>) -> Checked<Loaded> {
        let (mut faults, mut files) = (vec![], vec![]);
        let description =
            description.map(|text| description::parse(&Source::new(format!("{name}.ron"), text), &mut faults));
        let besides = Besides { description: description.as_ref(), additions: None };
        let scene = read(bytes.into(), name, name, None, besides, &mut files, &mut faults);
        match scene {
            Some(scene) if faults.iter().all(|d| d.severity != Severity::Error) => {
                Ok(Loaded { scene, notices: faults, files })
            }
            _ => Err(Faults(faults)),
        }
    }
}

fn from_files(path: &Path, additions: &Additions) -> Checked<Loaded> {
    let mut faults = vec![];
    let mut files = vec![];
    let found = resolve(path)?;
    let name = found.file_stem().unwrap_or(found.as_os_str()).to_string_lossy().into_owned();
    let (gltf, description) = if has_extension(&found, &["ron"]) {
        let source = Source::read(&found)?;
        files.push(found.clone());
        let description = description::parse(&source, &mut faults);
        match described_gltf(&found, &description) {
            Ok(gltf) => (gltf, Some(description)),
            // Which one the file names may be what can't be read of it.
            Err(_) if description.gltf.is_none() && !faults.is_empty() => return Err(Faults(faults)),
            Err(more) => {
                faults.extend(more.0);
                return Err(Faults(faults));
            }
        }
    } else {
        let description = beside(&found, &mut files, &mut faults)?;
        (found, description)
    };
    let shown = gltf.display().to_string();
    let bytes = read_file(&gltf).map_err(|why| {
        faults.push(Diagnostic::error(why));
        Faults(std::mem::take(&mut faults))
    })?;
    files.push(gltf.clone());
    let directory = gltf.parent().unwrap_or(Path::new(""));
    let besides = Besides { description: description.as_ref(), additions: Some(additions) };
    let scene = read(bytes.into(), &shown, &name, Some(directory), besides, &mut files, &mut faults);
    match scene {
        Some(scene) if faults.iter().all(|d| d.severity != Severity::Error) => {
            Ok(Loaded { scene, notices: faults, files })
        }
        _ => Err(Faults(faults)),
    }
}

/// What a scene consists of besides its glTF.
#[derive(Clone, Copy)]
pub(super) struct Besides<'a> {
    pub description: Option<&'a Description>,
    /// `None`: nothing is made up where the scene has no light or no camera.
    pub additions: Option<&'a Additions>,
}

/// A scene from a glTF's bytes, which are let go as soon as nothing more is read from them. Not to be used when
/// `faults` then holds an error; `None` only with one.
pub(super) fn read(
    bytes: Cow<'_, [u8]>,
    shown: &str,
    name: &str,
    directory: Option<&Path>,
    besides: Besides<'_>,
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) -> Option<Scene> {
    let Besides { description, additions } = besides;
    let mut scene = imported(&bytes, shown, name, directory, besides, files, faults)?;
    drop(bytes);
    let nodes = scene.pose(0.0).nodes;
    cluster(Arc::make_mut(&mut scene.geometry), &nodes);
    scene.glow = scene.mean_glow();
    scene.measure_normals();
    let dark = additions.is_none_or(|a| a.no_default_light) || description.is_some_and(|d| !d.default_light);
    complete::make_up(&mut scene, shown, dark, additions.is_some(), faults);
    // Colours of vertices take their part.
    if scene.geometry.more.colors.is_empty() {
        faults.extend(scene.materials.iter().filter_map(|m| without_loss(m, shown)));
    }
    scene.bounds = scene.swept_bounds();
    if let Some(d) = come_near(&mut scene, shown) {
        faults.push(d);
    }
    let reach = scene.bounds.min.abs().max(scene.bounds.max.abs()).max_element();
    if reach > super::geometry::MAX_COORDINATE || reach.is_nan() {
        let text = format!("{shown}: scene: it reaches {reach} metres from its origin, too far to compute with");
        faults.push(Diagnostic::error(text));
        return None;
    }
    let grid = description.and_then(|d| d.grid);
    scene.grid = grid.map_or(scene.bounds, |g| super::Bounds { min: g.min - scene.origin, max: g.max - scene.origin });
    Some(scene)
}

/// What the glTF and the scene RON say, before anything is worked out from it.
fn imported(
    bytes: &[u8],
    shown: &str,
    name: &str,
    directory: Option<&Path>,
    Besides { description, additions }: Besides<'_>,
    files: &mut Vec<PathBuf>,
    faults: &mut Vec<Diagnostic>,
) -> Option<Scene> {
    let document = Document::new(bytes, shown, directory, files, faults)?;
    let mut scene = import(&document, name, files, faults);
    if let Some(description) = description {
        complete::add_described(&mut scene, description, &document.shown, faults);
        apply(&mut scene, description, &document, faults);
    }
    if let Some(additions) = additions {
        complete::add_given(&mut scene, additions);
    }
    let described = description.and_then(|d| d.environment.as_ref());
    complete::add_environment(&mut scene, described, additions.and_then(|a| a.environment.as_ref()), files, faults);
    if faults.iter().any(|d| d.severity == Severity::Error) {
        return None;
    }
    if scene.geometry.indices.is_empty() {
        let d = document.error("scene", "it has no triangles");
        faults.push(d.help("export at least one mesh, at a node of the default scene"));
        return None;
    }
    Some(scene)
}

/// Farther than this from the origin, in its own sizes, a scene is moved to it.
const FAR_AWAY: f32 = 64.0;

/// Moves a scene that lies far from the origin to it: numbers of 32 bits have seven digits, and those that say how far
/// away it is are lost to what is in it.
fn come_near(scene: &mut Scene, shown: &str) -> Option<Diagnostic> {
    let (center, size) = (scene.bounds.center(), scene.bounds.diagonal());
    let away = center.abs().max_element();
    if !(away > FAR_AWAY * size && size > 0.0 && away <= super::geometry::MAX_COORDINATE) {
        return None;
    }
    // Whole multiples of a power of two, so that what is subtracted from coordinates leaves no rounding behind.
    let step = size.log2().ceil().exp2();
    scene.origin = (center / step).round() * step;
    for node in scene.nodes.iter_mut().filter(|n| n.parent.is_none()) {
        node.translation -= scene.origin;
        node.motion.iter_mut().for_each(|key| key.translation -= scene.origin);
        if let Some(animation) = &mut node.animation {
            animation.shift(-scene.origin);
        }
    }
    scene.bounds = scene.swept_bounds();
    let moved = format!(
        "{shown}: the scene lies {away} m from the origin, and is {size} m large; it is moved by {}",
        -scene.origin
    );
    // What vertices hold was rounded before it was read.
    let stored = scene.geometry.vertices.iter().flat_map(|v| v.position).fold(0.0, |m: f32, x| m.max(x.abs()));
    let apart = stored * f32::EPSILON;
    Some(if apart > 1e-5 * size {
        Diagnostic::warning(moved).help(format!(
            "its vertices are stored {stored} m from their nodes, where numbers are {apart} m apart: that rounding stays; \
             give the nodes the distance, and the vertices coordinates round 0"
        ))
    } else {
        Diagnostic::note(moved).help("nothing of the image is lost by it")
    })
}

/// Between surfaces that reflect all they get, light never fades: sums over bounces have no limit.
fn without_loss(material: &super::Material, shown: &str) -> Option<Diagnostic> {
    let kept = material.most_reflected();
    // An albedo above 1 has been spoken of.
    if kept < 1.0 || material.base_color.truncate().max_element() > 1.0 {
        return None;
    }
    let name = &material.name;
    Some(if kept > 1.0 {
        let text = format!("{shown}: material \"{name}\" reflects {kept} of the light it gets: more with every bounce");
        Diagnostic::warning(text)
            .help("lower its baseColorFactor or its specular strength; together they must stay below 1")
    } else {
        let text = format!("{shown}: material \"{name}\" reflects all light: between such walls it never fades");
        Diagnostic::note(text).help("lower its baseColorFactor below 1")
    })
}

/// What the scene RON adds, its names looked up.
fn apply(scene: &mut Scene, description: &Description, document: &Document<'_>, faults: &mut Vec<Diagnostic>) {
    let stated = description.materials.iter().map(|(name, finish)| (&*name.value, finish));
    let finishes: FxHashMap<_, _> = stated.collect();
    for material in &mut scene.materials {
        if let Some(finish) = finishes.get(&*material.name) {
            (material.specular, material.shininess) = (finish.specular, finish.shininess);
        }
    }
    let names: FxHashSet<&str> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    for (name, _) in description.materials.iter().filter(|(name, _)| !names.contains(&*name.value)) {
        let names = scene.materials.iter().map(|m| m.name.as_str());
        faults.push(unknown("material", name, names, &document.shown));
    }
    let mut moved: FxHashMap<usize, &Located<String>> = FxHashMap::default();
    for (name, keys) in &description.motion {
        let nodes = nodes_called(scene, &name.value);
        let &[node] = nodes.as_slice() else {
            if nodes.is_empty() {
                let lights = scene.lights.iter().map(|l| l.name.as_str());
                let names = scene.nodes.iter().map(|n| n.name.as_str()).chain(lights);
                faults.push(unknown("node", name, names, &document.shown));
            } else {
                let why = format!("{} has {} nodes called \"{}\"", document.shown, nodes.len(), name.value);
                faults
                    .push(Diagnostic::error(why).at(&name.span, "").help("give the node that moves a name of its own"));
            }
            continue;
        };
        if let Some(first) = moved.insert(node, name) {
            let d = Diagnostic::error(format!("\"{}\" moves a node that moves already", name.value));
            faults.push(d.at(&name.span, "").at(&first.span, "here").help("a node and its light move together"));
            continue;
        }
        let own = scene.nodes[node].translation;
        scene.nodes[node].motion = keys.iter().map(|key| keyframe(key, own)).collect();
    }
    scene.params.clone_from(&description.params);
    if let Some(name) = &description.camera {
        match scene.find_camera(&name.value) {
            Ok(camera) => scene.default_camera = Some(camera),
            Err(Faults(found)) => faults.extend(found.into_iter().map(|d| d.at(&name.span, ""))),
        }
    }
}

/// The nodes of this name, or else those at which lights or cameras of this name are.
fn nodes_called(scene: &Scene, name: &str) -> Vec<usize> {
    let mut nodes: Vec<usize> = (0..scene.nodes.len()).filter(|i| scene.nodes[*i].name == name).collect();
    if nodes.is_empty() {
        nodes.extend(scene.lights.iter().filter(|l| l.name == name).map(|l| l.node));
        nodes.extend(scene.cameras.iter().filter(|c| c.alias.as_deref() == Some(name)).map(|c| c.node));
        nodes.sort_unstable();
        nodes.dedup();
    }
    nodes
}

fn keyframe(key: &KeyframeText, own: Vec3) -> Keyframe {
    let rotation = key
        .rotation_degrees
        .and_then(|[x, y, z, degrees]| Vec3::new(x, y, z).try_normalize().map(|axis| (axis, degrees.to_radians())));
    Keyframe { time: key.time, translation: key.translation.map_or(own, Vec3::from), rotation }
}

fn unknown<'a>(what: &str, name: &Located<String>, names: impl Iterator<Item = &'a str>, shown: &str) -> Diagnostic {
    let names: Vec<&str> = names.collect();
    let d = Diagnostic::error(format!("{shown} has no {what} called \"{}\"", name.value));
    let d = d.at(&name.span, "").nearest(&name.value, names.iter().copied());
    // A long list would bury the nearest name.
    if names.len() <= 12 { d.help(format!("there are {}", names.join(", "))) } else { d }
}

/// The file that a path means.
fn resolve(path: &Path) -> Checked<PathBuf> {
    if has_extension(path, &["ron", "glb", "gltf"]) {
        return Ok(path.into());
    }
    if files::is_file(path) {
        let d =
            Diagnostic::error(format!("{} is no scene: a scene is a .gltf, a .glb or a scene .ron", path.display()));
        return Err(d.help("export it as glTF 2.0 (.glb), as Blender does with File > Export").into());
    }
    let with = |base: &Path, extension: &str| {
        let mut name = base.as_os_str().to_owned();
        name.push(extension);
        PathBuf::from(name)
    };
    let inside = path.file_name().map(|name| path.join(name));
    let tried: Vec<PathBuf> = std::iter::once(path)
        .chain(inside.as_deref())
        .flat_map(|base| [".ron", ".glb", ".gltf"].map(|extension| with(base, extension)))
        .collect();
    tried.iter().find(|p| files::is_file(p)).cloned().ok_or_else(|| {
        let list: Vec<String> = tried.iter().map(|p| p.display().to_string()).collect();
        let d = Diagnostic::error(format!("there is no scene {}", path.display()));
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let near = scenes_beside(path);
        d.nearest(&name, near.iter().map(String::as_str)).help(format!("looked for {}", list.join(", "))).into()
    })
}

/// Stems of the scenes in the directory of a path, sorted.
fn scenes_beside(path: &Path) -> Vec<String> {
    let directory = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten().map(|e| e.path());
    let scenes = entries.filter(|p| has_extension(p, &["ron", "glb", "gltf"]));
    let mut stems: Vec<String> = scenes.filter_map(|p| Some(p.file_stem()?.to_string_lossy().into_owned())).collect();
    stems.sort();
    stems.dedup();
    stems
}

/// The glTF that a scene RON names, or the one of its stem.
fn described_gltf(ron: &Path, description: &Description) -> Checked<PathBuf> {
    if let Some(name) = &description.gltf {
        let path = files::inside(ron.parent().unwrap_or(Path::new("")), &name.value)
            .map_err(|why| Diagnostic::error(format!("`{}` {why}", name.value)).at(&name.span, ""))?;
        if files::is_file(&path) && has_extension(&path, &["glb", "gltf"]) {
            return Ok(path);
        }
        let d = Diagnostic::error(format!("{} is no glTF file that is there", path.display()));
        return Err(d.at(&name.span, "").help("name a .glb or .gltf relative to the scene file").into());
    }
    let candidates = ["glb", "gltf"].map(|extension| ron.with_extension(extension));
    candidates.iter().find(|p| files::is_file(p)).cloned().ok_or_else(|| {
        let d = Diagnostic::error(format!("{} names no glTF, and none of its stem is beside it", ron.display()));
        d.help("add `gltf: \"name.glb\"`").into()
    })
}

/// The scene RON beside a glTF, when it is there and is this glTF's.
fn beside(gltf: &Path, files: &mut Vec<PathBuf>, faults: &mut Vec<Diagnostic>) -> Checked<Option<Description>> {
    let ron = gltf.with_extension("ron");
    if !files::is_file(&ron) {
        return Ok(None);
    }
    let source = Source::read(&ron)?;
    files.push(ron.clone());
    let description = description::parse(&source, faults);
    match &description.gltf {
        Some(name) if gltf.file_name().is_none_or(|file| *file != *name.value) => {
            let d = Diagnostic::warning(format!("{} describes another glTF and is not used", ron.display()));
            faults.push(d.at(&name.span, "").help(format!("load {} itself to see that scene", ron.display())));
            Ok(None)
        }
        _ => Ok(Some(description)),
    }
}

fn has_extension(path: &Path, any: &[&str]) -> bool {
    path.extension().is_some_and(|e| any.iter().any(|a| e.eq_ignore_ascii_case(a)))
}
