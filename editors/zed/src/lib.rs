//! Starts `lightgraph lsp`, which it finds on the PATH of the project.

use zed_extension_api::{self as zed, LanguageServerId, Result, Worktree};

struct Lightgraph;

impl zed::Extension for Lightgraph {
    fn new() -> Self {
        Lightgraph
    }

    fn language_server_command(&mut self, _: &LanguageServerId, worktree: &Worktree) -> Result<zed::Command> {
        let command = worktree.which("lightgraph").ok_or("lightgraph is not on the PATH")?;
        Ok(zed::Command { command, args: vec!["lsp".into()], env: vec![] })
    }
}

zed::register_extension!(Lightgraph);
