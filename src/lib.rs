//! lightgraph: a data-driven render-graph framework.
//!
//! A render graph is a RON file, WGSL shaders stand beside it; a plan turns both into passes on a device.
//!
//! ```text
//! RON, WGSL ───→ Project ──┐
//! glTF, RON ───→ Scene ────┼─→ Session: a Plan on a Gpu ──frame──→ FrameReport, Image
//!                Settings ─┘                           └──record─→ Frame, whose FrameReport arrives later
//! ```
//!
//! - [`Project`]: a graph with its shaders; [`Graph`]: what its file says, checked
//! - [`Scene`]: geometry, materials, lights, cameras; [`View`]: where a camera is and what it sees
//! - [`Settings`]: parameters, size, outputs of a session
//! - [`Gpu`]: a device, opened here or shared by a program; [`Memory`]: a texture or buffer that a program and a graph
//!   share
//! - [`Session`]: a project, a scene and a device over time; [`Plan`]: its ordered steps, pure data
//! - [`Frame`]: a recorded frame that the program submits; [`FrameReport`]: what a frame took
//! - [`Image`]: an output, read back
//! - [`Checked`]: a result, or all [`Faults`], each a [`Diagnostic`] with place, reason and remedy
//!
//! ```no_run
//! use lightgraph::{Checked, Gpu, Project, Scene, Session, Settings};
//! use std::path::Path;
//!
//! fn main() -> Checked<()> {
//!     let gpu = Gpu::open()?;
//!     let project = Project::open(Path::new("lightgraph:graphs/gi/uniform_grid.ron"), &[])?;
//!     let scene = Scene::load(Path::new("scenes/hall"))?.scene;
//!     let settings = Settings { size: [640, 480], skip: true, ..Settings::default() };
//!     let mut session = Session::new(&gpu, &project, scene, settings)?;
//!     session.frame(&gpu, 0, 0.0)?;
//!     session.image(&gpu, "color")?.save(Path::new("hall.png"))
//! }
//! ```
//!
//! Programs use the types of this root alone. [`internals`] holds the modules, without promise: what each is for stands
//! in `docs/architecture.md`. Without the default feature `gpu` the library reads, checks and plans graphs and builds
//! without wgpu.

#![forbid(unsafe_code)]

pub mod internals;

mod caught;
mod content;
mod lru;

pub use internals::diag::{Checked, Diagnostic, Faults};
#[cfg(feature = "gpu")]
pub use internals::gpu::{Frame, FrameReport, Gpu, Memory};
pub use internals::graph::Graph;
pub use internals::image::Image;
pub use internals::plan::Plan;
pub use internals::project::Project;
pub use internals::scene::{Scene, View};
#[cfg(feature = "gpu")]
pub use internals::session::{Session, Settings};

// Paths within the library.
pub(crate) use internals::{
    builtin, caches, diag, files, graph, image, math, parallel, plan, project, scene, shader, unused, value,
};
#[cfg(feature = "gpu")]
pub(crate) use internals::{gpu, session, verify};

#[cfg(test)]
mod tests {
    /// The names that `lib.rs` exports, one a line; a change of the list is a change of what the library promises.
    #[test]
    fn the_public_root_is_as_stated() {
        let uses = include_str!("lib.rs").split("\npub use internals::").skip(1);
        let lists = uses.filter_map(|rest| rest.split_once(';').map(|(list, _)| list));
        let name = |path: &str| path.trim().rsplit("::").next().unwrap_or_default().to_owned();
        let mut names: Vec<String> = lists
            .flat_map(|list| match list.split_once('{') {
                Some((_, several)) => several.trim_end_matches('}').split(',').map(name).collect(),
                None => vec![name(list)],
            })
            .filter(|name| !name.is_empty())
            .collect();
        names.sort();
        let stated: Vec<&str> = include_str!("../tests/public_root.txt").lines().collect();
        assert_eq!(names, stated, "tests/public_root.txt lists what lib.rs exports, at most 15 names");
        assert!(names.len() <= 15, "{} names", names.len());
        let modules = include_str!("lib.rs").lines().filter(|line| line.starts_with("pub mod "));
        assert_eq!(modules.collect::<Vec<_>>(), ["pub mod internals;"]);
    }
}
