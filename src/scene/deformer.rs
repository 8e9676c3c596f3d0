//! Skins and morph targets as a document states them, every number checked.

use super::{
    animation::Weights,
    deform::{Deformed, Morph, MorphTarget, Skin},
    document::{Document, Vectors, place},
    geometry::{MAX_COORDINATE, Vertex, face_normal},
    import::Placed,
};
use crate::diag::Diagnostic;
use glam::{Mat4, Vec3};
use gltf::json::{
    mesh::{Primitive as RawPrimitive, Semantic},
    validation::Checked,
};
use std::{collections::BTreeMap, sync::Arc};

/// What a primitive's vertices have for skins and morph targets.
#[derive(Default)]
pub(super) struct Deformable<'d> {
    /// Joints and weights of the vertices, in up to two sets of four.
    joints: Vec<(Vectors<'d, 4>, Vectors<'d, 4>)>,
    /// Displacements of positions and of normals, by target.
    targets: Vec<[Option<Vectors<'d, 3>>; 2]>,
    /// Whether normals are those of triangles.
    flat: bool,
    /// The largest joint that a vertex names.
    largest: usize,
}

/// Sets of four influences that are used.
const SETS: u32 = 2;

/// Displacements that one mesh, or all of a scene's together, may have.
pub(super) const MAX_DISPLACEMENTS: usize = 1 << 25;

/// What a document says of skins and of weights at rest, each read once.
pub(super) struct Stated<'d> {
    skins: Vec<Result<Joints, String>>,
    meshes: Vec<Rest<'d>>,
    nodes: Vec<Option<Rest<'d>>>,
}

/// Weights of morph targets where nothing moves them.
#[derive(Clone, Copy, Default)]
struct Rest<'d> {
    weights: &'d [f32],
    /// How many of them are 0 before the first that is not.
    zeros: usize,
    unusable: bool,
}

impl Rest<'_> {
    fn of(weights: &Vec<f32>) -> Rest<'_> {
        let zeros = weights.iter().take_while(|w| **w == 0.0).count();
        Rest { weights, zeros, unusable: !weights.iter().all(|w| w.abs() <= MAX_COORDINATE) }
    }
}

/// Nodes of the scene, and what brings vertices into their spaces.
type Joints = Arc<[(usize, Mat4)]>;

impl<'d> Stated<'d> {
    pub fn of(document: &'d Document<'_>, placed: &[Placed]) -> Stated<'d> {
        let rows: BTreeMap<usize, usize> =
            placed.iter().enumerate().filter(|(_, p)| !p.copy).map(|(row, p)| (p.index, row)).collect();
        let root = &document.root;
        Stated {
            skins: (0..root.skins.len()).map(|index| joints(document, &rows, index)).collect(),
            meshes: root.meshes.iter().map(|m| m.weights.as_ref().map(Rest::of).unwrap_or_default()).collect(),
            nodes: root.nodes.iter().map(|n| n.weights.as_ref().map(Rest::of)).collect(),
        }
    }
}

impl<'d> Deformable<'d> {
    pub fn read(
        document: &'d Document<'_>,
        raw: &RawPrimitive,
        at: &str,
        count: usize,
        faults: &mut Vec<Diagnostic>,
    ) -> Deformable<'d> {
        let read = Deformable::joints(document, raw, count).and_then(|(joints, largest)| {
            let targets = Deformable::targets(document, raw, count)?;
            let flat = !raw.attributes.contains_key(&Checked::Valid(Semantic::Normals));
            Ok(Deformable { joints, targets, flat, largest })
        });
        if raw.attributes.contains_key(&Checked::Valid(Semantic::Joints(SETS))) {
            faults.push(document.warning(at, "vertices follow their first eight joints; JOINTS_2 is left out"));
        }
        read.unwrap_or_else(|why| {
            faults.push(document.error(at, why));
            Deformable::default()
        })
    }

    fn joints(
        document: &'d Document<'_>,
        raw: &RawPrimitive,
        count: usize,
    ) -> Result<(Vec<(Vectors<'d, 4>, Vectors<'d, 4>)>, usize), String> {
        let (mut sets, mut largest) = (vec![], 0);
        for set in 0..SETS {
            let of = |semantic| raw.attributes.get(&Checked::Valid(semantic)).map(gltf::json::Index::value);
            let found = (of(Semantic::Joints(set)), of(Semantic::Weights(set)));
            let (joints, weights) = match found {
                (Some(joints), Some(weights)) => (document.floats::<4>(joints)?, document.floats::<4>(weights)?),
                (None, None) => break,
                _ => return Err(format!("it has only one of JOINTS_{set} and WEIGHTS_{set}")),
            };
            if [joints.len(), weights.len()] != [count; 2] {
                let [j, w] = [joints.len(), weights.len()];
                return Err(format!("{j} of JOINTS_{set} and {w} of WEIGHTS_{set}, but {count} of POSITION"));
            }
            for i in 0..count {
                let (names, shares) = (joints.get(i), weights.get(i));
                if !shares.iter().all(|w| (0.0..=MAX_COORDINATE).contains(w)) {
                    return Err(format!("WEIGHTS_{set} of vertex {i} is {shares:?}, no usable shares"));
                }
                if !names.iter().all(|j| (0.0..=65535.0).contains(j) && j.fract() == 0.0) {
                    return Err(format!("JOINTS_{set} of vertex {i} is {names:?}, no joints"));
                }
                let used = names.iter().zip(shares).filter(|(_, w)| *w > 0.0);
                largest = used.map(|(j, _)| *j as usize).fold(largest, usize::max);
            }
            sets.push((joints, weights));
        }
        Ok((sets, largest))
    }

    fn targets(
        document: &'d Document<'_>,
        raw: &RawPrimitive,
        count: usize,
    ) -> Result<Vec<[Option<Vectors<'d, 3>>; 2]>, String> {
        let stated = raw.targets.as_deref().unwrap_or_default();
        if stated.len().saturating_mul(count) > MAX_DISPLACEMENTS {
            let targets = stated.len();
            return Err(format!(
                "{targets} morph targets of {count} vertices; at most {MAX_DISPLACEMENTS} displacements fit"
            ));
        }
        let all = stated.iter().enumerate();
        let read = all.map(|(i, target)| {
            let vectors = |what: &str, accessor: Option<gltf::json::Index<gltf::json::Accessor>>| {
                let Some(accessor) = accessor else { return Ok(None) };
                let found =
                    document.floats::<3>(accessor.value()).map_err(|why| format!("targets[{i}] {what}: {why}"))?;
                if found.len() != count {
                    return Err(format!("{} of {what} in targets[{i}], but {count} of POSITION", found.len()));
                }
                let bad = found.iter().position(|v| !v.iter().all(|x| x.abs() <= MAX_COORDINATE));
                let why = |at| format!("{what} of vertex {at} in targets[{i}] is no usable vector");
                bad.map_or(Ok(Some(found)), |at| Err(why(at)))
            };
            Ok([vectors("POSITION", target.positions)?, vectors("NORMAL", target.normals)?])
        });
        read.collect()
    }
}

/// What a node does to the vertices of its mesh.
pub(super) struct Deformer<'d> {
    /// Which skin it is, and its joints.
    skin: Option<(usize, Joints)>,
    /// Whether the joints mirror at rest.
    mirrors: bool,
    rest: Rest<'d>,
    weights: Option<&'d Weights>,
}

impl<'d> Deformer<'d> {
    pub fn of(
        document: &Document<'_>,
        stated: &Stated<'d>,
        placed: &[Placed],
        p: &'d Placed,
        faults: &mut Vec<Diagnostic>,
    ) -> Deformer<'d> {
        let node = &document.root.nodes[p.index];
        let mesh = p.mesh.and_then(|mesh| stated.meshes.get(mesh));
        let at = || place("nodes", p.index, Some(&p.node.name));
        let index = node.skin.as_ref().map(|skin| skin.value()).filter(|_| mesh.is_some() && !p.copy);
        let skin = index.and_then(|index| match stated.skins.get(index) {
            Some(Ok(joints)) => Some((index, joints.clone())),
            Some(Err(why)) => {
                faults.push(document.error(at(), why.clone()));
                None
            }
            None => {
                faults.push(document.error(at(), format!("there is no skin {index}")));
                None
            }
        });
        let first = skin.as_ref().and_then(|(_, joints)| joints.first());
        let mirrors = first.is_some_and(|(node, bind)| (placed[*node].world * *bind).determinant() < 0.0);
        let rest = stated.nodes[p.index].or(mesh.copied()).unwrap_or_default();
        if rest.unusable {
            faults.push(document.error(at(), "a weight of its morph targets is no usable number"));
        }
        Deformer { skin, mirrors, rest, weights: p.weights.as_ref() }
    }

    /// Whether it moves the vertices of a primitive by more than the node.
    pub fn deforms(&self, of: &Deformable<'_>) -> bool {
        let rests = self.rest.zeros < self.rest.weights.len().min(of.targets.len());
        self.skins(of) || self.weights.is_some() && !of.targets.is_empty() || rests
    }

    /// How many displacements `vertices` of a primitive have, at most.
    pub fn displacements(of: &Deformable<'_>, vertices: usize) -> usize {
        of.targets.len().saturating_mul(vertices)
    }

    fn skins(&self, of: &Deformable<'_>) -> bool {
        self.skin.is_some() && !of.joints.is_empty()
    }

    /// What stands for the world's transform of a skinned primitive, which its node does not place: as far as it
    /// decides what is front.
    pub fn orientation(&self, of: &Deformable<'_>) -> Option<Mat4> {
        let across = if self.mirrors { -1.0 } else { 1.0 };
        self.skins(of).then(|| Mat4::from_scale(Vec3::new(across, 1.0, 1.0)))
    }

    /// Why a primitive can't follow the joints.
    pub fn fault(&self, of: &Deformable<'_>) -> Option<String> {
        let (named, there) = (of.largest, self.skin.as_ref()?.1.len());
        (self.skins(of) && named >= there).then(|| format!("a vertex follows joint {named}; its skin has {there}"))
    }

    /// `vertices` of a primitive at a node, which were at `sources` in it; the first is at `first` in the geometry.
    pub fn deformed(
        &self,
        of: &Deformable<'_>,
        node: u32,
        vertices: &[Vertex],
        first: usize,
        sources: &[u32],
    ) -> Deformed {
        let skin = self.skin.as_ref().filter(|_| self.skins(of)).map(|(index, joints)| {
            let (mut ends, mut influences) = (vec![], vec![]);
            for source in sources {
                let start = influences.len();
                influences.extend(follows(of, *source as usize, joints.len()));
                let sum: f32 = influences[start..].iter().map(|(_, w)| *w).sum();
                influences[start..].iter_mut().for_each(|(_, w)| *w /= sum);
                ends.push(influences.len() as u32);
            }
            Skin { index: *index, joints: joints.clone(), ends, influences }
        });
        let morph = (!of.targets.is_empty()).then(|| Morph {
            rest: (0..of.targets.len()).map(|i| self.rest.weights.get(i).copied().unwrap_or(0.0)).collect(),
            weights: self.weights.cloned(),
            targets: of.targets.iter().map(|t| target(t, of.flat, vertices, sources)).collect(),
        });
        Deformed { node: node as usize, vertices: first..first + vertices.len(), skin, morph }
    }
}

/// The joints that a vertex follows, with their weights: at least one.
fn follows(of: &Deformable<'_>, vertex: usize, there: usize) -> Vec<(u16, f32)> {
    let pairs = of.joints.iter().flat_map(|(joints, weights)| joints.get(vertex).into_iter().zip(weights.get(vertex)));
    let found: Vec<(u16, f32)> = pairs.filter(|(_, w)| *w > 0.0).map(|(j, w)| (j as u16, w)).collect();
    let sound = !found.is_empty() && found.iter().all(|(j, _)| usize::from(*j) < there);
    if sound { found } else { vec![(0, 1.0)] }
}

/// Where a target moves vertices. Normals of triangles follow the triangles.
fn target(
    [positions, normals]: &[Option<Vectors<'_, 3>>; 2],
    flat: bool,
    vertices: &[Vertex],
    sources: &[u32],
) -> MorphTarget {
    let get = |from: &Option<Vectors<'_, 3>>, i: usize| from.map_or(Vec3::ZERO, |v| v.get(sources[i] as usize).into());
    // The corners of a triangle follow on each other where its normal is its own.
    let corner = |i: usize| Vec3::from(vertices[i].position) + get(positions, i);
    let turned = |i: usize| {
        let first = i - i % 3;
        face_normal([first, first + 1, first + 2].map(corner)) - Vec3::from(vertices[i].normal)
    };
    let whole = vertices.len().is_multiple_of(3);
    let normal = |i: usize| if flat && whole { turned(i) } else { get(normals, i) };
    let all = (0..vertices.len()).map(|i| (i as u32, get(positions, i), normal(i)));
    MorphTarget { moved: all.filter(|(_, p, n)| *p != Vec3::ZERO || *n != Vec3::ZERO).collect() }
}

/// The joints of a skin; `rows` has those of `placed` by the document's nodes.
fn joints(document: &Document<'_>, rows: &BTreeMap<usize, usize>, index: usize) -> Result<Joints, String> {
    let skin = &document.root.skins[index];
    let at = place("skins", index, skin.name.as_deref());
    let binds = skin.inverse_bind_matrices.map(|a| document.floats::<16>(a.value())).transpose();
    let binds = binds.map_err(|why| format!("{at}: inverseBindMatrices: {why}"))?;
    if skin.joints.is_empty() || skin.joints.len() > usize::from(u16::MAX) {
        return Err(format!("{at} has {} joints", skin.joints.len()));
    }
    if let Some(binds) = binds.filter(|b| b.len() < skin.joints.len()) {
        return Err(format!("{at} has {} joints and {} inverseBindMatrices", skin.joints.len(), binds.len()));
    }
    let one = |(i, joint): (usize, &gltf::json::Index<gltf::json::Node>)| {
        let row = rows.get(&joint.value()).ok_or_else(|| format!("{at}: joint {joint} is no node of the scene"))?;
        let bind = binds.map_or(Mat4::IDENTITY, |b| Mat4::from_cols_array(&b.get(i)));
        let sound = bind.to_cols_array().iter().all(|x| x.abs() <= MAX_COORDINATE);
        sound.then_some((*row, bind)).ok_or_else(|| format!("{at}: inverse bind matrix {i} holds no usable number"))
    };
    skin.joints.iter().enumerate().map(one).collect()
}
