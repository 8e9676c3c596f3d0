//! The device: everything that needs an adapter. It walks a [`crate::plan::Plan`] and decides nothing.
//!
//! [`Gpu`] opens a device; [`prepare`] makes a plan ready for it and a scene; [`execute`] runs a frame;
//! [`read_image`] and [`read_buffer`] bring the results back. No call panics on what the device says: its
//! errors come back as faults with the step's name.

mod bindings;
mod buffers;
mod caches;
mod clear;
mod device;
mod device_loop;
mod dirty;
mod display;
mod encode;
mod execute;
mod frame;
mod node_places;
mod numerics;
mod pending;
mod pipelines;
mod pool;
mod prepare;
mod readback;
mod recorder;
mod refit;
mod reports;
mod scene_data;
mod scope;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod timing;
mod uniforms;
mod upload;
mod world_space;

pub use device::{ADAPTER_VARIABLE, Gpu, OpenError, set_patience, wanted_adapter};
pub use display::{Arrangement, Display, DisplayLook};
pub use execute::{FrameInputs, begin, execute, record};
pub use frame::{Frame, FrameReport, LoopReport, StepTime};
pub use numerics::{Broken, Numerics, ResourceNumbers};
pub use pool::{MOST_BYTES, Memory, Pool};
pub use prepare::{Prepared, prepare, prepare_after};
pub use readback::{
    PendingImage, PendingWords, read_buffer, read_bytes, read_content, read_image, read_image_later, read_plane,
    read_plane_later, read_words_later,
};
pub use timing::Timing;
pub use upload::{upload_bytes, upload_image, upload_shown};
