//! The window: a graph seen live, with all that can be set, compared and looked into.
//!
//! - `choice` is what the user chose (what undo takes back and files keep), `undo` its history, `state` the rest of
//!   what the window remembers; `pick` finds what lies under the pointer
//! - `stage` holds the sessions and makes frames; `engine` runs it on a thread of its own: it is told what is wanted,
//!   and tells what there is to show; `feed` is what it told so far; `variants` finds the graphs to choose from
//! - `link` follows the scene of another program; `editor` opens a file at a line
//! - `canvas` brings images of linear light to the screen
//! - `panels` are the parts of the window, `overlay` what lies on the image; `surface` draws them, `app` is the event
//!   loop, `script` plays events without a user
//!
//! Only `stage`, `engine`, `canvas` and `surface` see a device, only `app` and `surface` a window.

mod app;
mod canvas;
mod choice;
mod editor;
mod engine;
mod feed;
mod link;
mod overlay;
mod panels;
mod pick;
mod save;
mod script;
mod shown;
mod stage;
mod state;
mod surface;
mod undo;
mod variants;

pub use app::{Ended, WindowStart, run};
pub use choice::{Compare, ComparedTo, Resolution, SplitLayout, ViewChoice};
pub use link::{Link, NAME as LINKED};
pub use script::Script;
pub use variants::scenes;

/// The graph files of a folder, by name.
pub fn graphs(folder: &std::path::Path) -> Vec<std::path::PathBuf> {
    variants::files(folder, &["ron"])
}
