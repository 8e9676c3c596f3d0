//! Creates buffers, and the pipelines and bind groups of built-in kernels.

use super::{device::Gpu, scope::scoped};
use crate::diag::{Checked, Diagnostic};

/// Creates a buffer of zeros.
///
/// # Errors
/// Fails where no memory is left.
pub(super) fn empty(gpu: &Gpu, what: &str, size: u64, usage: wgpu::BufferUsages) -> Checked<wgpu::Buffer> {
    scoped(gpu, &format!("allocate {what}"), || {
        let desc = wgpu::BufferDescriptor { label: Some(what), size, usage, mapped_at_creation: false };
        gpu.device.create_buffer(&desc)
    })
}

/// Creates a buffer that holds the pieces one after the other, or one word of zero without any.
///
/// # Errors
/// Fails where the pieces take more than the device allows, or where no memory is left.
pub(super) fn filled(gpu: &Gpu, what: &str, pieces: &[&[u8]], usage: wgpu::BufferUsages) -> Checked<wgpu::Buffer> {
    let (ours, most): (u64, u64) = (pieces.iter().map(|bytes| bytes.len() as u64).sum(), most_bytes(gpu, usage));
    if ours > most {
        return Err(Diagnostic::error(format!("the {what} take {ours} bytes, and this device allows {most}"))
            .help("use a smaller scene")
            .into());
    }
    let buffer = empty(gpu, what, ours.max(4), usage | wgpu::BufferUsages::COPY_DST)?;
    let mut at = 0;
    for bytes in pieces {
        gpu.queue.write_buffer(&buffer, at, bytes);
        at += bytes.len() as u64;
    }
    Ok(buffer)
}

/// The largest buffer that the device allows for a usage.
fn most_bytes(gpu: &Gpu, usage: wgpu::BufferUsages) -> u64 {
    let bound =
        if usage.contains(wgpu::BufferUsages::STORAGE) { gpu.limits.max_storage_buffer_binding_size } else { u64::MAX };
    bound.min(gpu.limits.max_buffer_size)
}

/// Returns the pipeline of a built-in kernel, named by its entry point.
///
/// # Errors
/// Fails where the device refuses the kernel.
pub(super) fn kernel(gpu: &Gpu, text: &'static str, entry: &'static str) -> Checked<wgpu::ComputePipeline> {
    gpu.caches.kernels.get(&entry, || {
        scoped(gpu, &format!("build the kernel `{entry}`"), || {
            let (label, source) = (Some(entry), wgpu::ShaderSource::Wgsl(text.into()));
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
            gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label,
                layout: None,
                module: &module,
                entry_point: label,
                compilation_options: Default::default(),
                cache: None,
            })
        })
    })
}

/// Binds buffers to a kernel, in the order of its bindings.
///
/// # Errors
/// Fails where the device refuses them.
pub(super) fn bind_buffers(
    gpu: &Gpu,
    what: &str,
    pipeline: &wgpu::ComputePipeline,
    buffers: &[&wgpu::Buffer],
) -> Checked<wgpu::BindGroup> {
    let all = (0..).zip(buffers).map(|(binding, buffer)| {
        let resource = buffer.as_entire_binding();
        wgpu::BindGroupEntry { binding, resource }
    });
    let entries: Vec<_> = all.collect();
    scoped(gpu, &format!("prepare {what}"), || {
        let layout = &pipeline.get_bind_group_layout(0);
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(what), layout, entries: &entries })
    })
}
