// No entry point at all.
fn nothing() {}
