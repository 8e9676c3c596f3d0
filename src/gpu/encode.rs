//! Encodes one run of one step.

use super::{
    buffers::filled,
    device::Gpu,
    device_loop::DeviceLoop,
    dirty::{Arguments, Instances, workgroups},
    pipelines::{Built, view_mask},
    pool::{Memory, Pool, numbers, target_view},
    prepare::{PreparedPass, PreparedTarget, Ready, Shaded},
    recorder::Recorder,
    scene_data::SceneData,
    timing::TimestampPair,
    uniforms::Uniforms,
};
use crate::diag::{Checked, Diagnostic};
use crate::image::texel;
use crate::plan::cull::DRAW_BYTES;
use crate::plan::{Action, Draw, DrawGeometry, DrawMember, Place, Plan, ResourceId, StepId};

/// What encoding a step reads.
pub(super) struct EncodeContext<'a> {
    pub gpu: &'a Gpu,
    pub plan: &'a Plan,
    pub pool: &'a Pool,
    pub scene: &'a SceneData,
    pub uniforms: &'a Uniforms,
    pub steps: &'a [Ready],
    pub instances: &'a Instances,
}

/// Targets that a render pass has at most; wgpu allows no more.
const MOST_TARGETS: usize = 8;

/// What one run of a step is told besides the step.
pub(super) struct Run<'a> {
    /// Of the loops around, outermost first.
    pub iterations: &'a [u32],
    /// Where it writes its times.
    pub pair: Option<&'a TimestampPair>,
    /// Lets the device say whether it does anything.
    pub device_loop: Option<&'a DeviceLoop>,
    /// The step runs for its dirty instances.
    pub partial: bool,
}

impl EncodeContext<'_> {
    /// Encodes one run of a step. `offsets` is room that is used again from run to run.
    ///
    /// # Errors
    /// The step does not belong to what was prepared, or clears what can't be cleared. Errors of the device come when
    /// the encoder is finished.
    pub(super) fn encode(
        &self,
        record: &mut Recorder<'_>,
        id: StepId,
        run: &Run<'_>,
        offsets: &mut Vec<u32>,
    ) -> Checked<()> {
        let sizes = run.device_loop.map(|g| IndirectSizes { buffer: &g.sizes, at: g.place(id) });
        let (Some(step), Some(ready)) = (self.plan.steps.get(id.0), self.steps.get(id.0)) else {
            return Err(Diagnostic::error(format!("step {} is not in the plan", id.0)).into());
        };
        if let Ready::Shaded(shaded) = ready {
            offsets.clear();
            offsets.extend(shaded.uniforms.iter().map(|u| self.uniforms.offset(*u, run.iterations)));
        }
        let dirty = self.instances.arguments(id).filter(|_| run.partial);
        if dirty.is_some() {
            self.instances.choose(record, id);
        }
        if let (Action::Compute { groups, instances, indirect, .. }, Ready::Shaded(shaded)) = (&step.action, ready) {
            let size = match (sizes, dirty, indirect) {
                (Some(sizes), ..) => DispatchSize::Indirect(sizes),
                (None, Some(Arguments::Dispatch { groups, .. }), _) => {
                    DispatchSize::Indirect(IndirectSizes { buffer: groups, at: 0 })
                }
                (None, _, Some(counts)) => {
                    DispatchSize::Indirect(IndirectSizes { buffer: self.pool.buffer(self.plan, *counts)?, at: 0 })
                }
                (None, _, None) => DispatchSize::Direct(workgroups(self.gpu, *groups, *instances)),
            };
            let group = shaded.partial.as_ref().filter(|_| run.partial).unwrap_or(&shaded.group);
            self.compute(record, &step.name, size, (shaded, group), run, offsets);
            return Ok(());
        }
        let (encoder, name) = (record.encoder(), &step.name);
        match (&step.action, ready) {
            (Action::Draw(draw), Ready::Shaded(shaded)) => {
                self.draw(encoder, (name, draw), shaded, (run, sizes, dirty), offsets)
            }
            (Action::Copy { from, to }, _) => {
                self.timed(encoder, run.pair, |e| grouped(e, name, |e| self.copy(e, *from, *to)))
            }
            (Action::Clear { target, value }, _) => {
                self.timed(encoder, run.pair, |e| self.clear(e, name, *target, *value))
            }
            (Action::Compute { .. }, _) | (Action::Draw(_), Ready::Plain) => {
                Err(Diagnostic::error(format!("`{name}` was not prepared")).into())
            }
        }
    }

    fn timed(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pair: Option<&TimestampPair>,
        work: impl FnOnce(&mut wgpu::CommandEncoder) -> Checked<()>,
    ) -> Checked<()> {
        if let Some(p) = pair {
            encoder.write_timestamp(&p.set, p.begin);
        }
        work(encoder)?;
        if let Some(p) = pair {
            encoder.write_timestamp(&p.set, p.end);
        }
        Ok(())
    }

    /// In the pass that neighbours share, unless times can be taken at the ends of passes only.
    fn compute(
        &self,
        record: &mut Recorder<'_>,
        name: &str,
        size: DispatchSize<'_>,
        (shaded, group): (&Shaded, &wgpu::BindGroup),
        run: &Run<'_>,
        offsets: &[u32],
    ) {
        let Built::Compute(pipeline) = &shaded.pipelines.built else { return };
        let dispatch = |pass: &mut wgpu::ComputePass<'_>| {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, offsets);
            match size {
                DispatchSize::Indirect(sizes) => pass.dispatch_workgroups_indirect(sizes.buffer, sizes.at),
                DispatchSize::Direct([x, y, z]) => pass.dispatch_workgroups(x, y, z),
            }
        };
        let inside = self.gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES);
        if let Some(pair) = run.pair.filter(|_| !inside) {
            let times = wgpu::ComputePassTimestampWrites {
                query_set: &pair.set,
                beginning_of_pass_write_index: Some(pair.begin),
                end_of_pass_write_index: Some(pair.end),
            };
            let desc = wgpu::ComputePassDescriptor { label: Some(name), timestamp_writes: Some(times) };
            return dispatch(&mut record.encoder().begin_compute_pass(&desc));
        }
        if let Some(pair) = run.pair.filter(|p| !p.begun) {
            record.stamp(&pair.set, pair.begin);
        }
        let pass = record.compute();
        pass.push_debug_group(name);
        dispatch(pass);
        pass.pop_debug_group();
        if let Some(pair) = run.pair {
            record.stamp(&pair.set, pair.end);
        }
    }

    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (name, draw): (&str, &Draw),
        shaded: &Shaded,
        (run, sizes, dirty): (&Run<'_>, Option<IndirectSizes<'_>>, Option<&Arguments>),
        offsets: &[u32],
    ) -> Checked<()> {
        let Run { iterations, pair, .. } = *run;
        let last = shaded.passes.len().saturating_sub(1);
        // The arguments of draws that clear the places of instances, a row each.
        let indirect_clears = match dirty {
            Some(Arguments::Draws { clears, .. }) => Some(IndirectSizes { buffer: clears, at: 0 }),
            _ => sizes,
        };
        for (i, pass) in shaded.passes.iter().enumerate() {
            let times = pair.filter(|_| i == 0 || i == last).map(|p| wgpu::RenderPassTimestampWrites {
                query_set: &p.set,
                beginning_of_pass_write_index: (i == 0).then_some(p.begin),
                end_of_pass_write_index: (i == last).then_some(p.end),
            });
            let turn = if pass.targets.len() > 1 { iterations.last().copied().unwrap_or(0) as usize } else { 0 };
            let clears = pass.clears && indirect_clears.is_none();
            let Some(mut render) = begin(encoder, name, draw, pass, turn, clears, times) else { continue };
            if let (Some(clear), Some(arguments), true) = (shaded.clear.as_ref(), indirect_clears, pass.clears) {
                render.set_pipeline(clear);
                // A loop ends for all members at once.
                let some = if dirty.is_some() { pass.members.len() } else { 1 };
                for member in pass.members.iter().take(some) {
                    if dirty.is_some() {
                        place(&mut render, member);
                    }
                    render.draw_indirect(arguments.buffer, arguments.at + row(draw, member) * PLAIN_DRAW_BYTES);
                }
            }
            render.set_bind_group(0, &shaded.group, offsets);
            self.members(&mut render, draw, &shaded.pipelines.built, &pass.members, (sizes, dirty))?;
        }
        Ok(())
    }

    fn members(
        &self,
        render: &mut wgpu::RenderPass<'_>,
        draw: &Draw,
        built: &Built,
        members: &[DrawMember],
        (sizes, dirty): (Option<IndirectSizes<'_>>, Option<&Arguments>),
    ) -> Checked<()> {
        let Built::Render { first, rest, attributes } = built else { return Ok(()) };
        let mesh = match draw.geometry {
            DrawGeometry::Screen | DrawGeometry::Vertices { .. } => None,
            DrawGeometry::Scene { .. } => match &self.scene.mesh {
                Some(mesh) => Some(mesh),
                None => return Ok(()),
            },
        };
        if let Some(mesh) = mesh {
            render.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            if *attributes {
                render.set_vertex_buffer(0, mesh.vertices.slice(..));
            }
        }
        let seen = match (draw.indirect, dirty) {
            (Some(i), Some(Arguments::Draws { draws, .. })) => Some((draws, i)),
            (Some(i), _) => Some((self.pool.buffer(self.plan, i.buffer)?, i)),
            (None, _) => None,
        };
        let draws = seen.map_or([0..0, 0..0], |(_, i)| [0..i.first, i.first..i.first + i.second]);
        let [begin, split, end] = mesh.map_or([0; 3], |m| {
            let part = m.part(draw.level);
            [part.first, part.first + part.one_sided, part.first + part.count]
        });
        let [one_sided, others] = draws;
        let parts = match rest {
            None => [Some((first, begin..end, one_sided)), None],
            Some(rest) => [Some((first, begin..split, one_sided)), Some((rest, split..end, others))],
        };
        for (part, (pipeline, indices, draws)) in parts.into_iter().flatten().enumerate() {
            if mesh.is_some() && indices.is_empty() {
                continue;
            }
            render.set_pipeline(pipeline);
            for member in members {
                place(render, member);
                // The largest index has no end that fits; nothing asks for four billion members.
                let instance = member.index..member.index.saturating_add(1);
                let row = row(draw, member);
                // The first sizes of a draw in a loop that the device ends are those that clear.
                let all = draw.members.len() as u64;
                let sized = sizes.map(|s| (s.buffer, s.at + all * PLAIN_DRAW_BYTES));
                match (mesh, sized, seen) {
                    (Some(_), Some((buffer, at)), _) => {
                        render.draw_indexed_indirect(buffer, at + (part as u64 * all + row) * DRAW_BYTES);
                    }
                    (None, Some((buffer, at)), _) => render.draw_indirect(buffer, at + row * PLAIN_DRAW_BYTES),
                    (Some(_), None, Some((buffer, each))) => {
                        let at = row * u64::from(each.first + each.second) + u64::from(draws.start);
                        render.multi_draw_indexed_indirect(buffer, at * DRAW_BYTES, draws.len() as u32);
                    }
                    (Some(_), None, None) => render.draw_indexed(indices.clone(), 0, instance),
                    (None, None, _) => match draw.geometry {
                        DrawGeometry::Vertices { indirect: Some(counts), .. } => {
                            render.draw_indirect(self.pool.buffer(self.plan, counts)?, 0);
                        }
                        DrawGeometry::Vertices { count, instances, .. } => render.draw(0..count, 0..instances),
                        DrawGeometry::Screen | DrawGeometry::Scene { .. } => render.draw(0..3, instance),
                    },
                }
            }
        }
        Ok(())
    }

    fn copy(&self, encoder: &mut wgpu::CommandEncoder, from: ResourceId, to: ResourceId) -> Checked<()> {
        match (self.pool.memory(self.plan, from)?, self.pool.memory(self.plan, to)?) {
            // Two resources that share memory hold the same already.
            (Memory::Texture(a), Memory::Texture(b)) if a == b => {}
            (Memory::Buffer(a), Memory::Buffer(b)) if a == b => {}
            (Memory::Texture(a), Memory::Texture(b)) => {
                for mip in 0..a.mip_level_count().min(b.mip_level_count()) {
                    encoder.copy_texture_to_texture(
                        wgpu::TexelCopyTextureInfo { mip_level: mip, ..a.as_image_copy() },
                        wgpu::TexelCopyTextureInfo { mip_level: mip, ..b.as_image_copy() },
                        mip_size(a, mip),
                    );
                }
            }
            (Memory::Buffer(a), Memory::Buffer(b)) => encoder.copy_buffer_to_buffer(a, 0, b, 0, a.size().min(b.size())),
            (Memory::Texture(_), Memory::Buffer(_)) | (Memory::Buffer(_), Memory::Texture(_)) => {
                return Err(Diagnostic::error("a copy goes from texture to texture, or from buffer to buffer").into());
            }
        }
        Ok(())
    }

    fn clear(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        name: &str,
        target: ResourceId,
        value: [f64; 4],
    ) -> Checked<()> {
        match self.pool.memory(self.plan, target)? {
            Memory::Texture(texture) => clear_texture(self.gpu, encoder, (name, texture), value)?,
            Memory::Buffer(buffer) if value[0] == 0.0 => grouped(encoder, name, |e| e.clear_buffer(buffer, 0, None)),
            Memory::Buffer(buffer) => {
                let number = self.plan.resources[target.0].number;
                let bytes = numbers(number, value[0], buffer.size());
                let from = filled(self.gpu, "clear value", &[&bytes], wgpu::BufferUsages::COPY_SRC)?;
                grouped(encoder, name, |e| e.copy_buffer_to_buffer(&from, 0, buffer, 0, buffer.size()));
            }
        }
        Ok(())
    }
}

/// The arguments of an indirect draw without indices.
const PLAIN_DRAW_BYTES: u64 = 16;

/// Where the sizes of a step are that the device may set to zero.
#[derive(Clone, Copy)]
struct IndirectSizes<'a> {
    buffer: &'a wgpu::Buffer,
    at: u64,
}

/// How many workgroups a dispatch has.
enum DispatchSize<'a> {
    Direct([u32; 3]),
    Indirect(IndirectSizes<'a>),
}

/// Restricts what is drawn to a member's tile.
fn place(render: &mut wgpu::RenderPass<'_>, member: &DrawMember) {
    if let Place::Rect([x, y, width, height]) = member.place {
        render.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
        render.set_scissor_rect(x, y, width, height);
    }
}

/// The place of a member among those of its draw.
fn row(draw: &Draw, member: &DrawMember) -> u64 {
    draw.members.first().map_or(0, |first| member.index.saturating_sub(first.index)).into()
}

/// Names commands for a graphics debugger. A render pass has its label instead: wgpu gives each pass a command buffer
/// of its own, and Mesa 22.3 crashes where a group ends in another command buffer than it began in.
fn grouped<T>(encoder: &mut wgpu::CommandEncoder, name: &str, work: impl FnOnce(&mut wgpu::CommandEncoder) -> T) -> T {
    encoder.push_debug_group(name);
    let done = work(encoder);
    encoder.pop_debug_group();
    done
}

/// Sets every texel of every mip level and layer: by a render pass where the texture can be a target, else by copying.
/// A graphics debugger shows the commands by `name`.
///
/// # Errors
/// Neither way is open for its format and usage.
pub(super) fn clear_texture(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    (name, texture): (&str, &wgpu::Texture),
    value: [f64; 4],
) -> Checked<()> {
    for mip in 0..texture.mip_level_count() {
        let size = mip_size(texture, mip);
        if texture.usage().contains(wgpu::TextureUsages::RENDER_ATTACHMENT) {
            for layer in 0..size.depth_or_array_layers {
                clear_by_pass(encoder, (name, texture), (layer, mip), value);
            }
            continue;
        }
        let texel = texel::encode(texture.format(), value)
            .filter(|_| texture.usage().contains(wgpu::TextureUsages::COPY_DST))
            .ok_or_else(|| Diagnostic::error(format!("a texture of format {:?} can't be cleared", texture.format())))?;
        let row = (texel.len() * size.width as usize).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        let mut line = texel.repeat(size.width as usize);
        line.resize(row, 0);
        let bytes = line.repeat(size.height as usize);
        let from = filled(gpu, "clear value", &[&bytes], wgpu::BufferUsages::COPY_SRC)?;
        for layer in 0..size.depth_or_array_layers {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: u32::try_from(row).ok(),
                rows_per_image: Some(size.height),
            };
            let to = wgpu::TexelCopyTextureInfo {
                mip_level: mip,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                ..texture.as_image_copy()
            };
            let one = wgpu::Extent3d { depth_or_array_layers: 1, ..size };
            let from = wgpu::TexelCopyBufferInfo { buffer: &from, layout };
            grouped(encoder, name, |e| e.copy_buffer_to_texture(from, to, one));
        }
    }
    Ok(())
}

fn clear_by_pass(
    encoder: &mut wgpu::CommandEncoder,
    (name, texture): (&str, &wgpu::Texture),
    (layer, mip): (u32, u32),
    value: [f64; 4],
) {
    let view = target_view(texture, layer..layer.saturating_add(1), mip);
    let format = texture.format();
    let solid = texture.dimension() == wgpu::TextureDimension::D3;
    let color = [Some(wgpu::RenderPassColorAttachment {
        view: &view,
        depth_slice: solid.then_some(layer),
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(color(value)), store: wgpu::StoreOp::Store },
    })];
    let depth = wgpu::RenderPassDepthStencilAttachment {
        view: &view,
        depth_ops: format
            .has_depth_aspect()
            .then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(value[0] as f32), store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    };
    let is_depth = format.is_depth_stencil_format();
    drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(name),
        color_attachments: if is_depth { &[] } else { &color },
        depth_stencil_attachment: is_depth.then_some(depth),
        ..Default::default()
    }));
}

fn begin<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    name: &str,
    draw: &Draw,
    pass: &'e PreparedPass,
    turn: usize,
    clears: bool,
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> Option<wgpu::RenderPass<'e>> {
    let targets = pass.targets.get(turn)?;
    let attach = |(location, target): (usize, &'e Option<PreparedTarget>)| {
        let PreparedTarget { view, slice: depth_slice, resolve } = target.as_ref()?;
        let target = draw.color.iter().find(|t| t.location as usize == location)?;
        let load = match target.clear.filter(|_| clears) {
            Some(value) => wgpu::LoadOp::Clear(color(value)),
            None => wgpu::LoadOp::Load,
        };
        let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
        let resolve_target = resolve.as_ref();
        Some(wgpu::RenderPassColorAttachment { view, depth_slice: *depth_slice, resolve_target, ops })
    };
    let mut attachments = [const { None }; MOST_TARGETS];
    for (to, found) in attachments.iter_mut().zip(targets.color.iter().enumerate().map(attach)) {
        *to = found;
    }
    let attachments = attachments.get(..targets.color.len())?;
    let depth = draw.depth.as_ref().zip(targets.depth.as_ref()).map(|(depth, view)| {
        let clear = depth.clear.filter(|_| clears);
        wgpu::RenderPassDepthStencilAttachment {
            view,
            // Neither cleared nor written: read-only, so that the shader may sample it at the same time.
            depth_ops: (depth.write || depth.clear.is_some()).then_some(wgpu::Operations {
                load: clear.map_or(wgpu::LoadOp::Load, wgpu::LoadOp::Clear),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }
    });
    Some(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(name),
        color_attachments: attachments,
        depth_stencil_attachment: depth,
        timestamp_writes,
        occlusion_query_set: None,
        multiview_mask: view_mask(draw.views),
    }))
}

fn mip_size(texture: &wgpu::Texture, mip: u32) -> wgpu::Extent3d {
    texture.size().mip_level_size(mip, texture.dimension())
}

fn color([r, g, b, a]: [f64; 4]) -> wgpu::Color {
    wgpu::Color { r, g, b, a }
}
