//! Pages in a real browser.

use std::path::Path;
use std::process::Command;

/// Any of these will do.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// The document after a visit of ten seconds of the page's own clock.
pub fn visited(page: &Path, profile: &Path) -> String {
    let url = format!("file://{}", page.display());
    for browser in BROWSERS {
        let mut command = Command::new(browser);
        command.args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--window-size=1000,1200"]);
        command.arg(format!("--user-data-dir={}", profile.display()));
        command.args(["--virtual-time-budget=10000", "--dump-dom", &url]);
        match command.output() {
            Ok(output) => return String::from_utf8_lossy(&output.stdout).into_owned(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => panic!("can't start {browser}: {e}"),
        }
    }
    panic!("none of {} is installed; scripts/install-browser.sh installs one", BROWSERS.join(", "));
}
