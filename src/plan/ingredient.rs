//! What a result depends on: the kinds of it, and the words for it.

use crate::content::hash;
use std::collections::BTreeMap;

/// What a unit's result depends on, by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// The code that runs.
    Shader,
    /// Bytes of uniforms: parameters, facts, values of the frame, a member's index.
    Value,
    /// Rows of a scene's table.
    Table,
    /// The scene's triangles.
    Geometry,
    /// The scene's textures.
    Textures,
    /// What members see of the scene, each through its frustum, or read of their own parts of resources.
    Member,
    /// The version of a resource that is read, or written in part only.
    Input,
    /// Format, extent, layers and mips of a resource.
    Size,
    /// How drawing changes its targets: clear values, blending, depth test, culling.
    Target,
    /// Workgroups, draws and where they go, the value of a clear, and which variable stands for which resource.
    Extent,
    /// How often a loop goes round, and what ends it.
    Loop,
    Sampler,
    /// What a step left, as far as it is compared with what it left before. In no key.
    Result,
    /// Where what moved was before, as far as members are told. In no key.
    Moved,
}

/// Every kind that is in keys.
pub const KINDS: [Kind; 12] = [
    Kind::Shader,
    Kind::Value,
    Kind::Table,
    Kind::Geometry,
    Kind::Textures,
    Kind::Member,
    Kind::Input,
    Kind::Size,
    Kind::Target,
    Kind::Extent,
    Kind::Loop,
    Kind::Sampler,
];

/// One thing that a result depends on, by the name to show.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Ingredient {
    pub kind: Kind,
    pub name: String,
}

impl std::fmt::Display for Ingredient {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = &self.name;
        match self.kind {
            Kind::Shader => write!(f, "shader {name}"),
            Kind::Value | Kind::Input | Kind::Result | Kind::Moved => f.write_str(name),
            Kind::Table => write!(f, "table {name}"),
            Kind::Geometry => f.write_str("the scene's triangles"),
            Kind::Textures => f.write_str("the scene's textures"),
            Kind::Member => write!(f, "what its members {name}"),
            Kind::Size => write!(f, "size of {name}"),
            Kind::Target => f.write_str("how it draws"),
            Kind::Extent => f.write_str("how much it does"),
            Kind::Loop => write!(f, "loop {name}"),
            Kind::Sampler => write!(f, "sampler {name}"),
        }
    }
}

/// Ingredients with hashes of their contents.
pub type Ingredients = BTreeMap<Ingredient, u128>;

/// Two of one name, as two rows of one table: both count.
pub(super) fn add(all: &mut Ingredients, ingredient: Ingredient, content: u128) {
    let there = all.entry(ingredient).or_insert(0);
    *there = hash(&(*there, content));
}
