//! Small plans by hand, run on the machine's adapter.

mod compute;
mod dirty;
mod draw;
mod faults;
mod loops;
mod numerics;
