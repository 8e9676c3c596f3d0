//! One turn of the engine: what has arrived, and a frame of what is shown.

use super::{Engine, ShownPair};
use crate::made::{ComparedImage, PageSession};
use crate::tell;
use lightgraph::internals::fastest::Measuring;
use lightgraph::internals::gpu::{Arrangement, DisplayLook, StepTime};
use lightgraph::internals::image::png::ToneMap;
use lightgraph::{Checked, Diagnostic, Faults, Frame, FrameReport};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::sync::Arc;
use web_time::Instant;

/// Frames on their way at most: more would show later what happens now.
const UNDER_WAY: usize = 2;

/// Where a frame ran no step, so many turns pass before the next: only time goes on.
const SELDOM: u32 = 8;

impl Engine {
    /// Shows what was made, once the device has answered for all of it.
    fn swap(&mut self) -> Checked<bool> {
        if self.measuring.as_ref().is_some_and(Measuring::is_under_way) {
            return Ok(false);
        }
        let answered = self.gpu.answered().inspect_err(|_| self.next = None)?;
        let Some(mut next) = self.next.take_if(|_| answered) else { return Ok(false) };
        let [width, height] = next.first.session.settings.size;
        self.surface.configure(
            &self.gpu.device,
            &wgpu::SurfaceConfiguration {
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                format: self.format,
                color_space: Default::default(),
                width,
                height,
                present_mode: wgpu::PresentMode::Fifo,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Opaque,
                view_formats: vec![],
            },
        );
        let scene = |pair: &ShownPair| Arc::as_ptr(&pair.first.session.scene);
        let shown = self.shown.as_ref();
        let same_scene = shown.is_some_and(|s| scene(s) == scene(&next));
        let file = |pair: &ShownPair| pair.first.project.graph.files.first().cloned();
        if !same_scene || shown.is_none_or(|s| file(s) != file(&next)) {
            self.index[0] = 0;
        }
        let before = shown.and_then(|s| s.second.as_ref());
        let same_other = next.second.as_ref().zip(before).is_some_and(|(a, b)| a.is_like(b));
        if !same_scene || !same_other {
            self.index[1] = 0;
        }
        if std::mem::take(&mut self.first_wanted) {
            self.image_wanted = true;
        }
        next.since = Instant::now();
        self.shown = Some(next);
        self.score.reset();
        self.inspected.want(self.inspected.wanted.clone());
        self.frames = Default::default();
        (self.rest, self.failed) = ([false; 2], false);
        Ok(true)
    }

    pub(super) fn step(&mut self, time: f32) -> Checked<Value> {
        let swapped = match self.swap() {
            Ok(swapped) => swapped,
            // What was shown goes on; only what was to come is gone.
            Err(faults) if self.shown.is_some() && self.gpu.check().is_ok() => {
                return Ok(json!({ "faults": tell::diagnostics(&faults.0) }));
            }
            Err(faults) => return Err(faults),
        };
        let mut told = json!({ "swapped": swapped, "next": self.next.is_some() });
        for side in [0, 1] {
            let Some(report) = self.arrived(side)? else { continue };
            self.rest[side] = report.steps.is_empty() && !self.image_wanted;
            if !report.steps.is_empty() {
                self.score.changed();
                self.inspected.changed();
            }
            if side == 0 {
                told["report"] = self.report(&report);
            }
        }
        if let Some(score) = self.score.arrived(&self.gpu)? {
            told["score"] = score;
        }
        if let Some(inspected) = self.inspected.arrived(&self.gpu)? {
            told["inspected"] = inspected;
        }
        if self.measure(&mut told)? {
            told["idle"] = json!(false);
            return Ok(told);
        }
        self.turn = self.turn.wrapping_add(1);
        let alone = self.shown.as_ref().is_none_or(|s| !matches!(s.second, Some(ComparedImage::Graph(_))));
        let rest = self.rest[0] && (alone || self.rest[1]);
        let asleep = rest && !self.turn.is_multiple_of(SELDOM);
        let idle = asleep || self.failed || self.frames.iter().any(|frames| frames.len() >= UNDER_WAY);
        if !idle
            && self.shown.is_some()
            && let wgpu::CurrentSurfaceTexture::Success(target) = self.surface.get_current_texture()
        {
            let start = Instant::now();
            self.draw(&target, time, &mut told)?;
            self.gpu.queue.present(target);
            told["host_ms"] = json!(start.elapsed().as_secs_f64() * 1e3);
            told["index"] = json!(self.index[0]);
        }
        told["idle"] = json!(idle);
        Ok(told)
    }

    /// Records a frame of each of the pair, and shows both.
    fn draw(&mut self, target: &wgpu::SurfaceTexture, time: f32, told: &mut Value) -> Checked<()> {
        let (gpu, view, pointer) = (&self.gpu, self.view, self.pointer);
        let Some(ShownPair { first, second, .. }) = &mut self.shown else { return Ok(()) };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut record = |made: &mut PageSession, index: &mut u32, frames: &mut VecDeque<Frame>| -> Checked<()> {
            made.session.shift.view = view;
            made.session.pointer = pointer;
            frames.push_back(made.session.record(gpu, &mut encoder, *index, time)?);
            *index += 1;
            Ok(())
        };
        let ([index, other_index], [frames, other_frames]) = (&mut self.index, &mut self.frames);
        record(first, index, frames)?;
        if let Some(ComparedImage::Graph(made)) = second {
            record(made, other_index, other_frames)?;
        }
        let image = first.image()?;
        let (other, arrangement) = match &second {
            Some(other) => (other.image()?, self.arrangement),
            None => (image, Arrangement::First),
        };
        let look = DisplayLook { stops: self.exposure, tone_map: ToneMap::Neutral, arrangement };
        let seen = target.texture.create_view(&Default::default());
        self.display.draw(gpu, &mut encoder, [image, other], look, &seen);
        if let Some(other) = &second {
            self.score.read(gpu, first, other, &mut encoder)?;
        }
        if let Some(fault) = self.inspected.read(gpu, first, &mut encoder) {
            told["inspected"] = fault;
        }
        if self.image_wanted && self.image.is_none() {
            self.image = Some(first.session.image_later(gpu, &mut encoder, &first.output)?);
            self.image_wanted = false;
        }
        gpu.queue.submit([encoder.finish()]);
        self.drawn = true;
        Ok(())
    }

    /// The latest frame of one of the pair that has arrived.
    fn arrived(&mut self, side: usize) -> Checked<Option<FrameReport>> {
        let (mut latest, frames) = (None, &mut self.frames[side]);
        while let Some(first) = frames.front_mut() {
            let Some(report) = first.arrived(&self.gpu)? else { break };
            latest = Some(report);
            frames.pop_front();
        }
        Ok(latest)
    }

    fn report(&self, report: &FrameReport) -> Value {
        let Some(ShownPair { first: made, .. }) = &self.shown else { return Value::Null };
        let name = |step: usize| made.session.plan.steps.get(step).map_or("?", |s| s.name.as_str());
        let step =
            |s: &StepTime| json!({ "name": name(s.step), "runs": s.runs, "gpu_ms": s.gpu_ms, "cpu_ms": s.cpu_ms });
        let mut warnings: Vec<Diagnostic> = report.warnings.clone();
        warnings.extend(made.session.failed_checks(report));
        json!({
            "steps": report.steps.iter().map(step).collect::<Vec<_>>(),
            "wall_ms": report.wall_ms,
            "device_ms": report.device_ms,
            "checks": tell::diagnostics(&Faults(warnings).0),
        })
    }
}
