//! Helpers for tests on a device.

use super::Gpu;
use std::sync::LazyLock;

/// The adapter that all tests share.
pub fn gpu() -> &'static Gpu {
    static GPU: LazyLock<Gpu> = LazyLock::new(|| match Gpu::open() {
        Ok(gpu) => gpu,
        Err(e) => panic!("{}", crate::diag::Faults::from(e)),
    });
    &GPU
}
