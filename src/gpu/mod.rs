//! The device: everything that needs an adapter.
