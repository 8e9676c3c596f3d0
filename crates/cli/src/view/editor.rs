//! Opens a file at a line in the user's editor.

use lightgraph::internals::builtin;
use lightgraph::internals::diag::Span;
use std::path::Path;
use std::process::{Command, Stdio};

/// Starts the editor of `$VISUAL`, or else of `$EDITOR`, at the begin of a place. Returns what to tell the user.
///
/// # Errors
/// Neither is set, the place is in a file that the program carries, or the editor does not start.
pub fn open(place: &Span) -> Result<String, String> {
    let path = &place.source.path;
    if builtin::is_builtin(Path::new(path)) {
        return Err(format!("{path} comes with lightgraph; `lightgraph new` makes a copy to edit"));
    }
    let set = |name: &str| std::env::var(name).ok().filter(|v| !v.trim().is_empty());
    let editor = set("VISUAL").or_else(|| set("EDITOR")).ok_or("set VISUAL or EDITOR to the editor to open it in")?;
    let line = 1 + place.source.text.get(..place.start).map_or(0, |before| before.matches('\n').count());
    let words = command(&editor, path, line);
    let (program, arguments) = words.split_first().ok_or("VISUAL or EDITOR is empty")?;
    let started = Command::new(program).args(arguments).stdin(Stdio::null()).spawn();
    let mut child = started.map_err(|e| format!("`{program}` can't be started: {e}"))?;
    // Whoever ends is waited for, or it stays in the system's list.
    std::thread::spawn(move || child.wait());
    Ok(format!("{path}:{line} in {program}"))
}

/// The command for a line of a file, in the way of the editor: `+LINE FILE` unless it is known for another.
fn command(editor: &str, path: &str, line: usize) -> Vec<String> {
    let mut words: Vec<String> = editor.split_whitespace().map(String::from).collect();
    let program = words.first().map_or("", |w| w.rsplit(['/', '\\']).next().unwrap_or(w));
    match program.strip_suffix(".exe").unwrap_or(program) {
        "code" | "code-insiders" | "codium" | "cursor" => words.extend(["-g".into(), format!("{path}:{line}")]),
        "hx" | "helix" | "subl" | "zed" | "zeditor" => words.push(format!("{path}:{line}")),
        "kate" | "idea" | "clion" | "rustrover" => words.extend(["--line".into(), line.to_string(), path.into()]),
        _ => words.extend([format!("+{line}"), path.into()]),
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_editor_is_told_the_line_in_its_way() {
        for (editor, expected) in [
            ("vim", "vim +7 a b.ron"),
            ("/usr/bin/nvim-qt --nofork", "/usr/bin/nvim-qt --nofork +7 a b.ron"),
            ("code --wait", "code --wait -g a b.ron:7"),
            ("hx", "hx a b.ron:7"),
            ("kate", "kate --line 7 a b.ron"),
            ("emacsclient -n", "emacsclient -n +7 a b.ron"),
        ] {
            assert_eq!(command(editor, "a b.ron", 7).join(" "), expected);
        }
        // A path is one word, whatever is in it.
        assert_eq!(command("vim", "a b.ron", 7)[2], "a b.ron");
    }
}
