//! `lightgraph serve`: a page for a browser, from this machine.

use super::{Failure, print};
use crate::web;
use lightgraph::{Diagnostic, Faults};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Serves the playground, or a page that `export web` has made, until it is interrupted.
#[derive(Debug, Clone, clap::Args)]
pub struct ServeArgs {
    /// The folder of the page; without it, the playground that `make web` has made
    #[arg(value_name = "DIR")]
    pub folder: Option<PathBuf>,
    /// The port; 0 for any that is free
    #[arg(long, default_value_t = 8080)]
    pub port: u16,
    /// The address to listen at: by default this machine alone is answered
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    pub host: IpAddr,
}

/// Serves.
///
/// # Errors
/// There is no page, or the port is taken.
pub fn run(args: &ServeArgs) -> Result<u8, Failure> {
    let folder = match &args.folder {
        Some(folder) if folder.is_dir() => folder.clone(),
        Some(folder) => {
            let d = Diagnostic::error(format!("{} is no folder", folder.display()));
            return Err(Failure::Usage(d.help("make a page with `make web` or `lightgraph export web`").into()));
        }
        None => web::page(None)?,
    };
    let address = SocketAddr::new(args.host, args.port);
    let server = tiny_http::Server::http(address).map_err(|e| {
        let d = Diagnostic::error(format!("can't listen at {address}: {e}"));
        Faults::from(d.help("choose another with `--port`; 0 takes any that is free"))
    })?;
    let at = server.server_addr().to_ip().unwrap_or(address);
    print(&format!("serving {} at http://{at}/\nCtrl-C ends it\n", folder.display()));
    web::serve(&server, &folder);
    Ok(0)
}
