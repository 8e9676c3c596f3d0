//! `lightgraph lsp`: what the checker knows, in an editor. No device.

use super::Failure;
use lightgraph::Diagnostic;
#[cfg(feature = "lsp")]
use lightgraph::Faults;

/// Serves one editor by the Language Server Protocol, until it says goodbye.
#[derive(Debug, Clone, clap::Args)]
pub struct LspArgs {
    /// Accepted for editors that name the way they speak; there is no other
    #[arg(long)]
    pub stdio: bool,
}

/// # Errors
/// The editor breaks the protocol or goes away without a word.
#[cfg(feature = "lsp")]
pub fn run(_: &LspArgs) -> Result<u8, Failure> {
    let gone = |e| Faults::from(Diagnostic::error(format!("the editor can't be served: {e}")));
    lightgraph_lsp::serve().map_err(gone)?;
    Ok(0)
}

/// Says how to get a language server.
///
/// # Errors
/// Always: this program has none.
#[cfg(not(feature = "lsp"))]
pub fn run(_: &LspArgs) -> Result<u8, Failure> {
    let d = Diagnostic::error("this lightgraph was built without its language server");
    Err(Failure::Usage(d.help("build it with `--features lsp`").into()))
}
