//! Reads back without waiting: the frame copies bytes to one mappable buffer, which the host reads once the device is
//! done.

use super::{device::Gpu, readback::staging, recorder::Recorder};
use crate::diag::{Checked, Diagnostic};
use std::ops::Range;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// Mappable buffers that no frame uses, for the next one.
pub(super) type Spare = Arc<Mutex<Vec<wgpu::Buffer>>>;

/// Bytes on their way from the device. The frame that copies them must be submitted before they are asked for.
#[derive(Debug)]
pub(super) struct PendingBytes {
    /// `None`: there is nothing to wait for.
    buffer: Option<wgpu::Buffer>,
    size: u64,
    /// By part of what was copied; empty for what there is none of.
    parts: Vec<Range<usize>>,
    answer: Option<Receiver<Result<(), wgpu::BufferAsyncError>>>,
    spare: Spare,
}

impl PendingBytes {
    /// Copies the first so many bytes of each part's buffers, as the commands before leave them.
    ///
    /// # Errors
    /// No memory is left.
    pub(super) fn copy(
        gpu: &Gpu,
        record: &mut Recorder<'_>,
        spare: &Spare,
        of: &[Vec<(&wgpu::Buffer, u64)>],
    ) -> Checked<PendingBytes> {
        let mut parts = vec![];
        let mut end = 0;
        for part in of {
            let start = end;
            end += part.iter().map(|(_, bytes)| bytes).sum::<u64>();
            parts.push(start as usize..end as usize);
        }
        let mut pending = PendingBytes { buffer: None, size: end, parts, answer: None, spare: spare.clone() };
        if end == 0 {
            return Ok(pending);
        }
        let buffer = buffer(gpu, spare, end)?;
        let mut at = 0;
        for (from, bytes) in of.iter().flatten() {
            record.encoder().copy_buffer_to_buffer(from, 0, &buffer, at, *bytes);
            at += bytes;
        }
        pending.buffer = Some(buffer);
        Ok(pending)
    }

    /// Allocates a buffer of a size; the caller records the copy to it.
    ///
    /// # Errors
    /// No memory is left.
    pub(super) fn allocate(gpu: &Gpu, spare: &Spare, size: u64) -> Checked<(PendingBytes, wgpu::Buffer)> {
        let buffer = buffer(gpu, spare, size)?;
        let parts = std::iter::once(0..size as usize).collect();
        Ok((PendingBytes { buffer: Some(buffer.clone()), size, parts, answer: None, spare: spare.clone() }, buffer))
    }

    /// The bytes of each part, once the device has done the frame; never waits.
    ///
    /// # Errors
    /// The device fails.
    pub(super) fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Vec<Vec<u8>>>> {
        self.begin();
        gpu.poll()?;
        let Some(answer) = &self.answer else { return Ok(Some(self.empty())) };
        match answer.try_recv() {
            Ok(answer) => self.take(answer).map(Some),
            Err(TryRecvError::Empty) => Ok(None),
            Err(e @ TryRecvError::Disconnected) => Err(unreadable(&e).into()),
        }
    }

    /// As [`PendingBytes::arrived`], and waits.
    ///
    /// # Errors
    /// The device fails, or does not answer within [`Gpu::patience`].
    pub(super) fn wait(&mut self, gpu: &Gpu) -> Checked<Vec<Vec<u8>>> {
        self.begin();
        gpu.wait()?;
        let Some(answer) = &self.answer else { return Ok(self.empty()) };
        // The work is done; the answer may still be on its way, when another thread polls the same device.
        match answer.recv_timeout(super::readback::ANSWER) {
            Ok(answer) => self.take(answer),
            Err(e) => Err(unreadable(&e).into()),
        }
    }

    fn empty(&self) -> Vec<Vec<u8>> {
        self.parts.iter().map(|_| vec![]).collect()
    }

    fn begin(&mut self) {
        if let (Some(buffer), None) = (&self.buffer, &self.answer) {
            let (send, receive) = channel();
            buffer.slice(..self.size).map_async(wgpu::MapMode::Read, move |mapped| {
                // Without a receiver nobody waits for the answer.
                let _ = send.send(mapped);
            });
            self.answer = Some(receive);
        }
    }

    fn take(&mut self, answer: Result<(), wgpu::BufferAsyncError>) -> Checked<Vec<Vec<u8>>> {
        answer.map_err(|e| unreadable(&e))?;
        self.answer = None;
        let Some(buffer) = self.buffer.take() else { return Ok(self.empty()) };
        let bytes = buffer.slice(..self.size).get_mapped_range().map_err(|e| unreadable(&e))?;
        let parts = self.parts.iter().map(|part| bytes.get(part.clone()).unwrap_or_default().to_vec()).collect();
        drop(bytes);
        buffer.unmap();
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(buffer);
        Ok(parts)
    }
}

/// A mappable buffer of at least so many bytes.
fn buffer(gpu: &Gpu, spare: &Spare, size: u64) -> Checked<wgpu::Buffer> {
    let mut spare = spare.lock().unwrap_or_else(PoisonError::into_inner);
    let fits = spare.iter().position(|buffer| buffer.size() >= size && buffer.size() < 4 * size.max(256));
    match fits.map(|at| spare.swap_remove(at)) {
        Some(buffer) => Ok(buffer),
        None => staging(gpu, "a frame", size.max(256).next_power_of_two()),
    }
}

fn unreadable(e: &dyn std::fmt::Display) -> Diagnostic {
    Diagnostic::error(format!("can't read from the device: {e}"))
}
