//! Opens a device, best adapter first.

use super::{caches::Caches, scope::Mailbox};
use crate::diag::{Checked, Diagnostic, Faults};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// The environment variable that picks an adapter: a part of its name, in any case.
pub const ADAPTER_VARIABLE: &str = "WGPU_ADAPTER_NAME";

/// The part of an adapter's name that the user asks for. Bytes that are no text are asked for too: nothing has them in
/// its name.
pub fn wanted_adapter() -> Option<String> {
    std::env::var_os(ADAPTER_VARIABLE).map(|n| n.to_string_lossy().into_owned()).filter(|n| !n.is_empty())
}

/// What a graph can profit from; the device has those of them that its adapter has.
const WANTED: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES)
    .union(wgpu::Features::FLOAT32_FILTERABLE)
    .union(wgpu::Features::FLOAT32_BLENDABLE)
    .union(wgpu::Features::RG11B10UFLOAT_RENDERABLE)
    .union(wgpu::Features::TEXTURE_FORMAT_16BIT_NORM)
    .union(wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES)
    .union(wgpu::Features::MULTIVIEW)
    .union(wgpu::Features::SUBGROUP)
    .union(wgpu::Features::INDIRECT_FIRST_INSTANCE);

/// An open device. Every other part of the program reaches the GPU through it.
///
/// ```no_run
/// use lightgraph::{Checked, Gpu};
///
/// fn main() -> Checked<()> {
///     let gpu = Gpu::open()?;
///     println!("{}", gpu.info.name);
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct Gpu {
    pub adapter: wgpu::Adapter,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub info: wgpu::AdapterInfo,
    pub features: wgpu::Features,
    pub limits: wgpu::Limits,
    /// Nanoseconds a timestamp tick.
    pub timestamp_period: f32,
    /// How long a wait for the device may take: ten minutes, unless the caller sets it here.
    pub patience: Duration,
    polls: AtomicU32,
    pub(super) mailbox: Arc<Mailbox>,
    pub(super) caches: Caches,
}

/// How long a wait for the device may take. No step of a graph should take as long.
pub const PATIENCE: Duration = Duration::from_secs(600);

static DEFAULT_PATIENCE: OnceLock<Duration> = OnceLock::new();

/// Sets [`Gpu::patience`] of devices that are opened from now on. The first call counts.
pub fn set_patience(patience: Duration) {
    DEFAULT_PATIENCE.get_or_init(|| patience);
}

/// Why there is no device.
#[derive(Debug, Clone, PartialEq)]
pub enum OpenError {
    /// The machine has no adapter that fits.
    NoAdapter(Diagnostic),
    /// There is an adapter, but it gives no device.
    Other(Faults),
}

impl From<OpenError> for Faults {
    fn from(e: OpenError) -> Faults {
        match e {
            OpenError::NoAdapter(d) => d.into(),
            OpenError::Other(f) => f,
        }
    }
}

/// RenderDoc sets this variable in the programs that it starts: they show it the names of passes and resources.
const RENDERDOC_VARIABLE: &str = "ENABLE_VULKAN_RENDERDOC_CAPTURE";

fn names() -> wgpu::InstanceFlags {
    match std::env::var_os(RENDERDOC_VARIABLE) {
        Some(_) => wgpu::InstanceFlags::DEBUG,
        None => wgpu::InstanceFlags::empty(),
    }
}

impl Gpu {
    /// Opens the best adapter: discrete, integrated, virtual, other, then software. [`ADAPTER_VARIABLE`] narrows
    /// the choice. The device has the adapter's own limits.
    ///
    /// # Errors
    /// [`OpenError::NoAdapter`] when none is found or none fits the variable, with the remedy;
    /// [`OpenError::Other`] when every adapter that fits refuses to give a device.
    pub fn open() -> Result<Gpu, OpenError> {
        Gpu::open_named(wanted_adapter().as_deref())
    }

    /// As [`Gpu::open`], with the part of the name given here.
    ///
    /// # Errors
    /// As [`Gpu::open`].
    pub fn open_named(part: Option<&str>) -> Result<Gpu, OpenError> {
        Gpu::open_for(&Gpu::instance(), part, None)
    }

    /// What surfaces are made of and adapters are found through.
    pub fn instance() -> wgpu::Instance {
        wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN | wgpu::Backends::METAL,
            // WGPU_DEBUG=1 hands names to a graphics debugger, WGPU_VALIDATION=1 loads the driver's checks.
            flags: names().with_env(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        })
    }

    /// As [`Gpu::open_named`], among the adapters of `instance` that can show images on `surface`, where one is given.
    ///
    /// # Errors
    /// As [`Gpu::open`].
    pub fn open_for(
        instance: &wgpu::Instance,
        part: Option<&str>,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Gpu, OpenError> {
        let mut adapters =
            pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN | wgpu::Backends::METAL));
        adapters.sort_by_key(|a| rank(a.get_info().device_type));
        let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
        if let Some(part) = part {
            let part = part.to_lowercase();
            adapters.retain(|a| a.get_info().name.to_lowercase().contains(&part));
        }
        if let Some(surface) = surface {
            let found = adapters.len();
            adapters.retain(|a| a.is_surface_supported(surface));
            if found > 0 && adapters.is_empty() {
                let d = Diagnostic::error(format!("none of these adapters can draw to a window: {}", names.join(", ")));
                return Err(OpenError::NoAdapter(
                    d.help("install a driver with window support, or render without one"),
                ));
            }
        }
        let mut faults = vec![];
        for adapter in adapters {
            match Gpu::from_adapter(adapter) {
                Ok(gpu) => return Ok(gpu),
                Err(f) => faults.extend(f.0),
            }
        }
        Err(if faults.is_empty() {
            OpenError::NoAdapter(no_adapter(part, &names))
        } else {
            OpenError::Other(Faults(faults))
        })
    }

    /// A device of this adapter, with the adapter's own limits and what it has of the features wanted.
    ///
    /// # Errors
    /// The adapter gives no device.
    pub fn from_adapter(adapter: wgpu::Adapter) -> Checked<Gpu> {
        pollster::block_on(Gpu::request(adapter))
    }

    /// As [`Gpu::from_adapter`], for programs that can't wait, as those of a browser.
    ///
    /// # Errors
    /// As [`Gpu::from_adapter`].
    pub async fn request(adapter: wgpu::Adapter) -> Checked<Gpu> {
        let info = adapter.get_info();
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("lightgraph"),
            required_features: adapter.features() & WANTED,
            required_limits: adapter.limits(),
            ..Default::default()
        });
        let (device, queue) = request.await.map_err(|e| {
            Diagnostic::error(format!("the adapter `{}` gives no device: {e}", info.name))
                .help(format!("choose another with {ADAPTER_VARIABLE}=PART_OF_ITS_NAME, or update its driver"))
        })?;
        Ok(Gpu::from_parts(adapter, device, queue))
    }

    /// A device that another program opened. What it has of features and limits is what graphs get. Errors that no
    /// scope catches, and the loss of the device, are told to lightgraph from now on: handlers set before are replaced.
    pub fn from_parts(adapter: wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Gpu {
        let mailbox = Mailbox::install(&device);
        let (features, limits, timestamp_period) = (device.features(), device.limits(), queue.get_timestamp_period());
        Gpu {
            info: adapter.get_info(),
            adapter,
            device,
            queue,
            features,
            limits,
            timestamp_period,
            patience: *DEFAULT_PATIENCE.get().unwrap_or(&PATIENCE),
            polls: AtomicU32::new(0),
            mailbox,
            caches: Caches::default(),
        }
    }

    /// A device without hardware: it checks what is asked of it against `limits`, and computes nothing.
    ///
    /// # Errors
    /// `limits` are not consistent.
    pub fn noop(limits: wgpu::Limits) -> Checked<Gpu> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::NOOP,
            backend_options: wgpu::BackendOptions {
                noop: wgpu::NoopBackendOptions {
                    enable: true,
                    limits: Some(limits),
                    // It has no formats of its own, only those that every device has.
                    features: Some(WANTED - wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES),
                    ..Default::default()
                },
                ..Default::default()
            },
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let options = wgpu::RequestAdapterOptions::default();
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|e| Diagnostic::error(format!("the device without hardware can't be made: {e}")))?;
        Gpu::from_adapter(adapter)
    }

    /// True when a software driver does the work.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Drops the cached pipelines, samplers and uploads. Sessions keep what they use; the next session makes its own.
    pub fn forget(&self) {
        self.caches.clear();
    }

    /// # Errors
    /// The device is lost.
    pub fn check(&self) -> Checked<()> {
        // The loss is told while the device is polled; what the poll itself says is no news to anybody.
        let _ = self.polled(wgpu::PollType::Poll);
        self.mailbox.lost()
    }

    /// How often the device has been polled or waited for so far. A frame that is recorded adds nothing.
    pub fn polls(&self) -> u32 {
        self.polls.load(Ordering::Relaxed)
    }

    fn polled(&self, kind: wgpu::PollType) -> Result<wgpu::PollStatus, wgpu::PollError> {
        self.polls.fetch_add(1, Ordering::Relaxed);
        self.device.poll(kind)
    }

    /// Waits until the device has done all that was submitted.
    ///
    /// # Errors
    /// The device is lost, or can't be waited for.
    pub fn wait(&self) -> Checked<()> {
        self.wait_for(None)
    }

    /// Lets the device tell what it has done, without waiting for any of it.
    ///
    /// # Errors
    /// The device is lost.
    pub fn poll(&self) -> Checked<()> {
        let polled = self.polled(wgpu::PollType::Poll);
        self.mailbox.lost()?;
        match polled {
            Ok(_) => Ok(()),
            Err(e) => Err(Diagnostic::error(format!("can't ask the device: {e}")).into()),
        }
    }

    /// As [`Gpu::wait`], for one submission and those before it.
    ///
    /// # Errors
    /// As [`Gpu::wait`].
    pub(super) fn wait_for(&self, submission: Option<wgpu::SubmissionIndex>) -> Checked<()> {
        let timeout = Some(self.patience);
        let polled = self.polled(wgpu::PollType::Wait { submission_index: submission, timeout });
        self.mailbox.lost()?;
        match polled {
            Ok(_) => Ok(()),
            Err(wgpu::PollError::Timeout) => {
                // Whoever drops the last handle waits for what never ends.
                std::mem::forget((self.device.clone(), self.queue.clone()));
                self.mailbox.give_up(self.patience);
                self.mailbox.lost()
            }
            Err(e) => Err(Diagnostic::error(format!("can't wait for the device: {e}")).into()),
        }
    }
}

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn no_adapter(part: Option<&str>, names: &[String]) -> Diagnostic {
    match part {
        Some(part) if !names.is_empty() => Diagnostic::error(format!("no adapter has `{part}` in its name"))
            .help(format!("adapters here: {}", names.join(", ")))
            .help(format!("set or unset {ADAPTER_VARIABLE}")),
        _ => Diagnostic::error("no Vulkan or Metal adapter is found")
            .help("install a GPU's Vulkan driver, or the software one: on Debian and Ubuntu `apt install mesa-vulkan-drivers libvulkan1`"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::testing;

    #[test]
    fn an_adapter_opens_with_its_own_limits() {
        let gpu = testing::gpu();
        assert_eq!(gpu.limits.max_texture_array_layers, gpu.adapter.limits().max_texture_array_layers);
    }

    #[test]
    fn a_name_that_no_adapter_has_is_told_apart() {
        match Gpu::open_named(Some("no such adapter")) {
            Err(OpenError::NoAdapter(d)) => assert!(!d.help.is_empty(), "{d:?}"),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn without_adapters_the_remedy_names_the_packages() {
        let d = no_adapter(None, &[]);
        assert!(d.help[0].contains("apt install mesa-vulkan-drivers libvulkan1"), "{d:?}");
    }
}
