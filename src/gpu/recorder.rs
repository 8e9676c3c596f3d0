//! Records commands: owns the encoder, the scope that catches its errors, and the compute pass that consecutive
//! dispatches share.
//!
//! wgpu makes separate command buffers for each pass, so consecutive dispatches stay in one. wgpu still orders them by
//! what they read and write.

use super::{device::Gpu, scope::ErrorScope};

/// Commands that are encoded and not yet submitted.
pub(super) struct Recorder<'a> {
    gpu: &'a Gpu,
    // Before the encoder, which nothing may end while a pass is open.
    pass: Option<wgpu::ComputePass<'static>>,
    open: Option<(wgpu::CommandEncoder, ErrorScope<'a>)>,
    /// The caller's, which takes all commands in place of encoders of its own.
    lent: Option<&'a mut wgpu::CommandEncoder>,
    /// Something has been encoded.
    used: bool,
    /// The last command in the shared pass is a timestamp.
    stamped: bool,
}

impl<'a> Recorder<'a> {
    pub(super) fn new(gpu: &'a Gpu) -> Recorder<'a> {
        Recorder { gpu, pass: None, open: None, lent: None, used: false, stamped: false }
    }

    /// Into an encoder that the caller submits.
    pub(super) fn into(gpu: &'a Gpu, encoder: &'a mut wgpu::CommandEncoder) -> Recorder<'a> {
        Recorder { lent: Some(encoder), ..Recorder::new(gpu) }
    }

    /// Whether the caller submits: nothing can be waited for.
    pub(super) fn is_lent(&self) -> bool {
        self.lent.is_some()
    }

    /// Whether anything has been encoded since the beginning.
    pub(super) fn is_used(&self) -> bool {
        self.used
    }

    /// The encoder in use, or a new one; a shared pass ends.
    pub(super) fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.pass = None;
        self.stamped = false;
        self.used = true;
        let gpu = self.gpu;
        if let Some(lent) = &mut self.lent {
            return lent;
        }
        let (encoder, _) = self.open.get_or_insert_with(|| {
            let scope = ErrorScope::begin(gpu);
            (gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") }), scope)
        });
        encoder
    }

    /// The shared compute pass, or a new one.
    pub(super) fn compute(&mut self) -> &mut wgpu::ComputePass<'static> {
        self.stamped = false;
        let pass = match self.pass.take() {
            Some(pass) => pass,
            None => self.encoder().begin_compute_pass(&Default::default()).forget_lifetime(),
        };
        self.pass.insert(pass)
    }

    /// Writes the time to a query in the shared compute pass.
    pub(super) fn stamp(&mut self, set: &wgpu::QuerySet, query: u32) {
        self.compute().write_timestamp(set, query);
        self.stamped = true;
    }

    /// Whether nothing has come since [`Recorder::stamp`].
    pub(super) fn stamped(&self) -> bool {
        self.stamped
    }

    /// What is to be submitted, and the scope to end after that; `None` when that is nothing.
    pub(super) fn finish(&mut self) -> Option<(wgpu::CommandBuffer, ErrorScope<'a>)> {
        self.pass = None;
        self.stamped = false;
        self.open.take().map(|(encoder, scope)| (encoder.finish(), scope))
    }
}
