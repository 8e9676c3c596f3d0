//! A language server for graphs and their shaders: what the checker knows, under the cursor.
//!
//! ```text
//! editor ──messages─→ server ──texts─→ checker ─diagnostics─→ editor
//!                       └──────answers──────────────────────→ editor
//! ```
//!
//! - `text`: lines and columns as editors count them; `uri`: addresses of files
//! - `texts`: open documents over the files of the disk
//! - `graphs`: the graphs of a workspace, and what each is made of
//! - `told`: faults in the words of the protocol
//! - `checker`: on a thread of its own, the faults of every graph that an open document is part of
//! - `words`: the words of the language; `ron`: what each word of a graph file is for, however broken the file
//! - `mentions`, `wgsl`: the names in graph files and in shaders; `workspace` looks at each file once for a text
//! - `symbols`: what names mean across files; `answers`: definitions, references, renames
//! - `complete`: what may stand at a cursor; `hover`: what is known of a name; `computed`: what a graph comes to
//! - `outline`: symbols, folds, hints and lenses of a document; `semantic`: what words in strings are; `fixes`:
//!   edits that faults propose
//! - `status`: what passes took last, from a run that goes on
//! - `capabilities`: what the server says of itself; `server`: messages in and out
//!
//! What must stay true: a fault here is a fault of `lightgraph check`, in the same words at the same place; no text
//! ends the server; answers don't wait for checks.

#![forbid(unsafe_code)]

mod answers;
mod capabilities;
mod checker;
mod complete;
mod computed;
mod fixes;
mod graphs;
mod hover;
mod mentions;
mod outline;
mod ron;
mod semantic;
mod server;
pub mod status;
mod symbols;
mod text;
mod texts;
mod told;
mod uri;
mod wgsl;
mod words;
mod workspace;

pub use server::serve;
