//! What takes a look at whole images: the exposure that suits them, how far apart two are, what a resource holds. Done
//! seldom while they change.

use super::super::choice::ComparedTo;
use super::super::feed::{ResourceContent, ResourceView, ShownScore};
use super::kept::KeptSession;
use super::{FrameRequest, ResourcePart, ViewStage};
use lightgraph::internals::gpu;
use lightgraph::internals::image::exposure::Exposure;
use lightgraph::internals::image::metrics;
use lightgraph::{Checked, Gpu, Memory, Session};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// At most so often while images change.
const SELDOM: Duration = Duration::from_millis(400);
/// Words of a buffer that are shown.
const MOST_WORDS: usize = 4096;

/// The last looks, each with the images that it was taken at, and when.
#[derive(Default)]
pub(super) struct Looks {
    score: Option<(u64, Instant, Arc<ShownScore>)>,
    inspected: Option<(u64, ResourcePart, Instant, Arc<ResourceView>)>,
    /// The stops that suit.
    exposed: Option<(u64, Instant, f32)>,
}

impl ViewStage {
    /// Stops that the shown image is well exposed with. While images follow each other they stay unless they are far
    /// off, so that what moves does not flicker.
    pub(super) fn expose(&mut self, wish: &FrameRequest, rest: bool) -> f32 {
        let (images, before) = (self.images, self.looks.exposed);
        let due = before.is_none_or(|(of, at, _)| of != images && (rest || at.elapsed() > SELDOM));
        if wish.choice.exposure == Exposure::Auto && due {
            let shown = self.shown.as_ref().and_then(|s| self.find(s));
            let image = shown.and_then(|k| gpu::read_plane(&self.gpu, k.image.as_ref()?, &k.output, 0, 0).ok());
            if let Some(stops) = image.map(|image| wish.choice.exposure.stops(&image)) {
                let stays = before.filter(|b| !rest && (b.2 - stops).abs() < 1.0);
                self.looks.exposed = Some((images, Instant::now(), stays.map_or(stops, |b| b.2)));
            }
        }
        self.looks.exposed.map_or(0.0, |e| e.2)
    }

    pub(super) fn score(&mut self, wish: &FrameRequest, rest: bool) -> Option<Arc<ShownScore>> {
        if wish.choice.compare.against == ComparedTo::Nothing {
            self.looks.score = None;
            return None;
        }
        let due = self.looks.score.as_ref().is_none_or(|s| s.0 != self.images && (rest || s.1.elapsed() > SELDOM));
        if due {
            let score = match self.metrics(wish) {
                Ok(Some(m)) => ShownScore::Metrics(m),
                Ok(None) => return None,
                Err(f) => ShownScore::Fault(f.0.first().map_or(String::new(), |d| d.message.clone())),
            };
            self.looks.score = Some((self.images, Instant::now(), Arc::new(score)));
        }
        self.looks.score.as_ref().map(|s| s.2.clone())
    }

    fn metrics(&self, wish: &FrameRequest) -> Checked<Option<metrics::Metrics>> {
        let read = |kept: &KeptSession| match &kept.image {
            Some(image) => gpu::read_plane(&self.gpu, image, &kept.output, 0, 0).map(Some),
            None => Ok(None),
        };
        let shown = self.shown.as_ref().and_then(|s| self.find(s));
        let Some(test) = shown.map(read).transpose()?.flatten() else { return Ok(None) };
        match &wish.choice.compare.against {
            ComparedTo::Nothing => Ok(None),
            ComparedTo::Graph(path) => match self.find(path).map(read).transpose()?.flatten() {
                Some(reference) => metrics::compare(&test, &reference, None).map(Some),
                None => Ok(None),
            },
            ComparedTo::Image(_) => match &self.reference {
                Some((_, Ok(r))) => metrics::compare(&test, &r.image, None).map(Some),
                _ => Ok(None),
            },
        }
    }

    pub(super) fn inspect(&mut self, wish: &FrameRequest, rest: bool) -> Option<Arc<ResourceView>> {
        let wanted = wish.inspect.as_ref()?;
        let due = self.looks.inspected.as_ref().is_none_or(|(images, what, at, _)| {
            what != wanted || (*images != self.images && (rest || at.elapsed() > SELDOM))
        });
        if due {
            let kept = self.shown.as_ref().and_then(|s| self.find(s))?;
            let inspected = Arc::new(look_into(&self.gpu, &kept.session, wanted)?);
            self.looks.inspected = Some((self.images, wanted.clone(), Instant::now(), inspected));
        }
        self.looks.inspected.as_ref().map(|i| i.3.clone())
    }
}

/// Reads a part of a resource; `None` when the plan has no such resource.
fn look_into(gpu: &Gpu, session: &Session, wanted: &ResourcePart) -> Option<ResourceView> {
    let at = session.plan.resources.iter().position(|r| r.name == wanted.resource)?;
    let id = lightgraph::internals::plan::ResourceId(at);
    let name = &wanted.resource;
    let (mut mip, mut layer) = (wanted.mip, wanted.layer);
    let content = session.memory(id).and_then(|memory| match memory {
        Memory::Texture(texture) => {
            mip = mip.min(texture.mip_level_count() - 1);
            let layers = texture.size().mip_level_size(mip, texture.dimension()).depth_or_array_layers;
            layer = layer.min(layers.saturating_sub(1));
            gpu::read_plane(gpu, texture, name, mip, layer).map(ResourceContent::Plane)
        }
        Memory::Buffer(buffer) => {
            let bytes = gpu::read_bytes(gpu, buffer, name)?;
            let words = bytes.chunks_exact(4).take(MOST_WORDS);
            let words = words.map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]])).collect();
            Ok(ResourceContent::Words(words, buffer.size()))
        }
    });
    let content =
        content.unwrap_or_else(|f| ResourceContent::Fault(f.0.first().map_or(String::new(), |d| d.message.clone())));
    Some(ResourceView { name: name.clone(), id, mip, layer, content })
}
