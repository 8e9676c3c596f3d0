//! What takes a look at numbers: how far the image is from what it is held against, and what a resource holds. Done
//! seldom while they change; nothing is waited for.

use crate::made::{ComparedImage, PageSession};
use lightgraph::internals::gpu::{PendingImage, PendingWords, read_plane_later, read_words_later};
use lightgraph::internals::image::metrics;
use lightgraph::internals::image::paint::{Channel, PaintLook, paint};
use lightgraph::internals::plan::ResourceId;
use lightgraph::{Checked, Diagnostic, Gpu, Image, Memory};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;
use web_time::Instant;

/// At most so often while images change.
const SELDOM: Duration = Duration::from_millis(400);

/// Words of a buffer that are shown.
const MOST_WORDS: u64 = 4096;

/// When something is read back: after what it was read from has changed, and not too often.
#[derive(Default)]
struct Due {
    changed: bool,
    last: Option<Instant>,
}

impl Due {
    fn now(&mut self) -> bool {
        let due = self.changed && self.last.is_none_or(|at| at.elapsed() > SELDOM);
        if due {
            *self = Due { changed: false, last: Some(Instant::now()) };
        }
        due
    }
}

/// An image that is read back, or known.
enum PendingPixels {
    Under(PendingImage),
    There(Arc<Image>),
}

impl PendingPixels {
    fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Arc<Image>>> {
        if let PendingPixels::Under(pending) = self {
            let Some(image) = pending.arrived(gpu)? else { return Ok(None) };
            *self = PendingPixels::There(Arc::new(image));
        }
        Ok(match self {
            PendingPixels::There(image) => Some(image.clone()),
            PendingPixels::Under(_) => None,
        })
    }
}

/// How far two images are apart.
#[derive(Default)]
pub struct ImageScore {
    due: Due,
    pair: Option<[PendingPixels; 2]>,
}

impl ImageScore {
    /// One of the images may be another now.
    pub fn changed(&mut self) {
        self.due.changed = true;
    }

    /// Forgets what was under way.
    pub fn reset(&mut self) {
        *self = ImageScore { due: Due { changed: true, last: None }, pair: None };
    }

    /// Begins to read both, where that is due.
    ///
    /// # Errors
    /// An image can't be read back.
    pub fn read(
        &mut self,
        gpu: &Gpu,
        shown: &PageSession,
        other: &ComparedImage,
        encoder: &mut wgpu::CommandEncoder,
    ) -> Checked<()> {
        if self.pair.is_some() || !self.due.now() {
            return Ok(());
        }
        let first = shown.session.image_later(gpu, encoder, &shown.output)?;
        let second = match other {
            ComparedImage::Graph(made) => PendingPixels::Under(made.session.image_later(gpu, encoder, &made.output)?),
            ComparedImage::Image { image, .. } => PendingPixels::There(image.clone()),
        };
        self.pair = Some([PendingPixels::Under(first), second]);
        Ok(())
    }

    /// The errors of the last pair of images, when they have come.
    ///
    /// # Errors
    /// The device fails.
    pub fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Value>> {
        let Some([first, second]) = &mut self.pair else { return Ok(None) };
        let (Some(test), Some(reference)) = (first.arrived(gpu)?, second.arrived(gpu)?) else { return Ok(None) };
        self.pair = None;
        Ok(Some(match metrics::compare(&test, &reference, None) {
            Ok(found) => json!(found),
            Err(faults) => json!({ "fault": message(&faults.0) }),
        }))
    }
}

fn message(faults: &[Diagnostic]) -> String {
    faults.first().map_or(String::new(), |d| d.message.clone())
}

/// Which resource is looked into, and how.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inspect {
    pub resource: String,
    pub mip: u32,
    /// A layer, a cube's face (6 for each cube) or a slice.
    pub layer: u32,
    pub channel: Channel,
    /// The numbers shown darkest and brightest; `None`: the least and the largest there are.
    pub range: Option<[f32; 2]>,
    pub false_color: bool,
}

enum PendingRead {
    Plane(PendingImage),
    Words(PendingWords, u64),
}

/// What a resource holds.
#[derive(Default)]
pub struct Inspected {
    pub wanted: Option<Inspect>,
    due: Due,
    under_way: Option<PendingRead>,
    plane: Option<Image>,
    /// The plane as red, green, blue and alpha, until the page takes it.
    pub pixels: Vec<u8>,
}

impl Inspected {
    pub fn want(&mut self, wanted: Option<Inspect>) {
        *self = Inspected { wanted, due: Due { changed: true, last: None }, ..Inspected::default() };
    }

    /// The resource may hold something else now.
    pub fn changed(&mut self) {
        self.due.changed = true;
    }

    /// Values of a texel of the plane that was read last.
    pub fn texel(&self, x: u32, y: u32) -> Vec<f32> {
        self.plane.as_ref().and_then(|plane| plane.pixel(0, x, y)).unwrap_or_default().to_vec()
    }

    /// Begins to read, where that is due. What is wrong is told as what the resource holds.
    pub fn read(&mut self, gpu: &Gpu, shown: &PageSession, encoder: &mut wgpu::CommandEncoder) -> Option<Value> {
        let wanted = self.wanted.as_ref()?;
        if self.under_way.is_some() || !shown.session.settings.inspect || !self.due.now() {
            return None;
        }
        match begin(gpu, shown, wanted, encoder) {
            Ok(reading) => self.under_way = Some(reading),
            Err(faults) => return Some(json!({ "fault": message(&faults.0) })),
        }
        None
    }

    /// What the resource held, when it has come.
    ///
    /// # Errors
    /// The device fails.
    pub fn arrived(&mut self, gpu: &Gpu) -> Checked<Option<Value>> {
        let (Some(wanted), Some(reading)) = (&self.wanted, &mut self.under_way) else { return Ok(None) };
        let told = match reading {
            PendingRead::Plane(pending) => {
                let Some(plane) = pending.arrived(gpu)? else { return Ok(None) };
                let look = PaintLook { channel: wanted.channel, range: wanted.range, false_color: wanted.false_color };
                let (pixels, extent) = paint(&plane, look);
                let told = json!({
                    "width": plane.width, "height": plane.height, "channels": plane.channels,
                    "least": extent.least, "most": extent.most, "mean": extent.mean,
                    "not_a_number": extent.not_a_number, "infinite": extent.infinite,
                });
                self.pixels = pixels;
                self.plane = Some(plane);
                told
            }
            PendingRead::Words(pending, bytes) => {
                let Some(words) = pending.arrived(gpu)? else { return Ok(None) };
                json!({ "bytes": bytes, "words": words })
            }
        };
        self.under_way = None;
        Ok(Some(told))
    }
}

fn begin(gpu: &Gpu, shown: &PageSession, wanted: &Inspect, encoder: &mut wgpu::CommandEncoder) -> Checked<PendingRead> {
    let name = &wanted.resource;
    let resources = &shown.session.plan.resources;
    let Some(at) = resources.iter().position(|r| r.name == *name) else {
        return Err(Diagnostic::error(format!("the graph has no resource `{name}`")).into());
    };
    match shown.session.memory(ResourceId(at))? {
        Memory::Texture(texture) => {
            read_plane_later(gpu, (texture, name), wanted.mip, wanted.layer, encoder).map(PendingRead::Plane)
        }
        Memory::Buffer(buffer) => {
            let words = read_words_later(gpu, (buffer, name), MOST_WORDS, encoder)?;
            Ok(PendingRead::Words(words, buffer.size()))
        }
    }
}
