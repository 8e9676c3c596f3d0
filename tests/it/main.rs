//! Everything from the outside: texts in, faults or images out.
//!
//! - `bad`: every file of `tests/bad` gives the errors that stand at its head
//! - `bad_scenes`: scenes with one fault each are refused with the reason
//! - `closed_forms`: light whose amount is known on paper, in every pixel
//! - `command`: exit codes, messages and files of the `lightgraph` command
//! - `graph_snapshots`: every test of `tests/graphs` holds
//! - `test_command`: `lightgraph test` and `lightgraph new`
//! - `mutations`: the tests of `tests/graphs` notice what is edited
//! - `references`: images and probes against another renderer
//! - `shipped`: every graph, shader and scene of the repository is found and sound
//! - `skips`: frames that leave steps out equal frames in full, whatever moves
//! - `mutated`: damaged texts and files give faults with places, never a panic
//! - `snapshots`: one tiny picture of the whole
//! - `stress`: numerical stability: the cases that matter most
//! - `traced`: graphs that trace rays, against another renderer and against rasterisation
//! - `twins`: shaders against the Rust of the same mathematics
//! - `watch`: live reload without a window
//! - `support`, `device`: what several of them need

mod bad;
mod bad_scenes;
mod closed_forms;
mod command;
mod device;
mod graph_snapshots;
mod mutated;
mod mutations;
mod references;
mod shipped;
mod skips;
mod snapshots;
mod stress;
mod support;
mod test_command;
mod traced;
mod twins;
mod watch;
