//! Everything from the outside: texts in, faults or images out.
//!
//! - `bad`: every file of `tests/bad` gives the errors that stand at its head
//! - `support`: what several of them need

mod bad;
mod support;
