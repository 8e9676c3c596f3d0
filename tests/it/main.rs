//! Everything from the outside: texts in, faults or images out.
//!
//! - `bad`: every file of `tests/bad` gives the errors that stand at its head
//! - `shipped`: every graph, shader and scene of the repository is found and sound
//! - `mutated`: damaged texts and files give faults with places, never a panic
//! - `support`: what several of them need

mod bad;
mod mutated;
mod shipped;
mod support;
