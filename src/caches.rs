//! The user's folder for what can be made again.

use std::path::PathBuf;

/// `None` where the system names no such folder.
pub fn folder() -> Option<PathBuf> {
    let named = |variable| std::env::var_os(variable).map(PathBuf::from).filter(|p| p.is_absolute());
    let home = || std::env::home_dir().filter(|p| p.is_absolute());
    let all = if cfg!(windows) {
        named("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        home().map(|h| h.join("Library/Caches"))
    } else {
        named("XDG_CACHE_HOME").or_else(|| home().map(|h| h.join(".cache")))
    };
    all.map(|f| f.join("lightgraph"))
}
