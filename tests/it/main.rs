//! Everything from the outside: texts in, faults or images out.
//!
//! - `bad`: every file of `tests/bad` gives the errors that stand at its head
//! - `bad_scenes`: scenes with one fault each are refused with the reason
//! - `command`: exit codes, messages and files of the `lightgraph` command
//! - `shipped`: every graph, shader and scene of the repository is found and sound
//! - `mutated`: damaged texts and files give faults with places, never a panic
//! - `support`: what several of them need

mod bad;
mod bad_scenes;
mod command;
mod mutated;
mod shipped;
mod support;
