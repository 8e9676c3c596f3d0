//! Graphs within another program's frame. The program shares its device, its encoder, its camera and its textures. It
//! shows two pictures: a room that a graph lights, and lamps that the program draws and lends to another graph, which
//! makes them glow. Nothing waits before a frame is handed over. `cargo run --example embed -- out/embed.png`.

use lightgraph::{Checked, Diagnostic, Frame, FrameReport, Gpu, Memory, Project, Scene, Session, Settings, View};
use std::path::Path;
use std::sync::Arc;

/// Of the program's image, in pixels.
const SIZE: [u32; 2] = [256, 144];
/// Of each picture in it.
const PICTURE: [u32; 2] = [120, 120];
/// What the program's lamps are drawn to, and what a graph's input is unless it says otherwise.
const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// The program's own shaders: three lamps that circle, one step each frame; and a texel of a picture, tone-mapped, in
/// its place.
const SHADERS: &str = "
struct QuadVertex {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) frame: u32,
}
@vertex fn corners(@builtin(vertex_index) i: u32, @builtin(instance_index) frame: u32) -> QuadVertex {
    return QuadVertex(vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0), frame);
}
@fragment fn lamps(corner: QuadVertex) -> @location(0) vec4f {
    var light = vec3f(0.02, 0.02, 0.03);
    for (var lamp = 0u; lamp < 3u; lamp++) {
        let angle = 0.1 * f32(corner.frame) + 2.0944 * f32(lamp);
        let place = 60.0 + 36.0 * vec2f(cos(angle), sin(angle));
        light[lamp] += 20.0 * f32(distance(corner.at.xy, place) < 8.0);
    }
    return vec4f(light, 1.0);
}
@group(0) @binding(0) var picture: texture_2d<f32>;
override left: f32 = 0.0;
override top: f32 = 0.0;
@fragment fn shown(corner: QuadVertex) -> @location(0) vec4f {
    let light = textureLoad(picture, vec2u(corner.at.xy - vec2f(left, top)), 0).rgb;
    return vec4f(light / (1.0 + light), 1.0);
}
";

fn main() -> Checked<()> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "out/embed.png".into());
    let program = Program::start()?;
    let mut pictures = program.pictures()?;
    let frames = program.frames(&mut pictures, 10)?;
    write(Path::new(&out), frames.last().map_or(&[], Vec::as_slice))
}

/// A program with a device and images of its own, as any that draws with wgpu.
struct Program {
    /// How lightgraph sees the device. Both use it, in turn.
    gpu: Gpu,
    shaders: wgpu::ShaderModule,
    /// What the program draws, and lends.
    lamps: wgpu::Texture,
    lamps_pipeline: wgpu::RenderPipeline,
    target: wgpu::Texture,
}

impl Program {
    fn start() -> Checked<Program> {
        // `WGPU_DEBUG=1` hands the names of passes to a graphics debugger.
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            flags: wgpu::InstanceFlags::empty().with_env(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let wanted = wgpu::RequestAdapterOptions::default();
        let fault = |e: &dyn std::fmt::Display| Diagnostic::error(format!("no device: {e}"));
        let adapter = pollster::block_on(instance.request_adapter(&wanted)).map_err(|e| fault(&e))?;
        // Graphs may use what the device was opened with, and no more: ask for the adapter's limits.
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: adapter.features() & wgpu::Features::FLOAT32_FILTERABLE,
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|e| fault(&e))?;
        let shaders = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADERS.into()),
        });
        // Whatever a graph reads, it may also have to copy.
        let lent = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let lamps = image(&device, PICTURE, LIGHT, lent);
        let target = image(&device, SIZE, wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureUsages::COPY_SRC);
        let lamps_pipeline = pipeline(&device, &shaders, ("lamps", &[]), LIGHT, &[]);
        Ok(Program { gpu: Gpu::from_parts(adapter, device, queue), shaders, lamps, lamps_pipeline, target })
    }

    fn pictures(&self) -> Checked<[HostPicture; 2]> {
        let room = Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.glb"))?.scene;
        Ok([
            HostPicture::new(self, 0, "lightgraph:graphs/gi/direct.ron", "direct", room)?,
            // A graph that looks at no scene takes any.
            HostPicture::new(self, 1, "lightgraph:graphs/post/bloom.ron", "color", Scene::stand_in()?.scene)?,
        ])
    }

    /// The program's loop. A frame is one submission: lamps, both graphs, the target. Bytes of each frame's target,
    /// read when all are under way.
    fn frames(&self, [room, glow]: &mut [HostPicture; 2], count: u32) -> Checked<Vec<Vec<u8>>> {
        let mut under_way = vec![];
        for index in 0..count {
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            self.draw_lamps(&mut encoder, index);
            // New content, in the same memory: only the version is another.
            glow.session.import(&self.gpu, "hdr", self.lamps.clone(), index.into())?;
            room.session.shift.view = Some(orbit(&room.session.scene, 0.05 * index as f32));
            for picture in [&mut *room, &mut *glow] {
                let frame = picture.session.record(&self.gpu, &mut encoder, index, index as f32 / 60.0)?;
                picture.frames.push(frame);
            }
            self.draw(&mut encoder, &[room, glow]);
            let bytes = self.copy(&mut encoder);
            self.gpu.queue.submit([encoder.finish()]);
            bytes.slice(..).map_async(wgpu::MapMode::Read, |_| ());
            under_way.push(bytes);
            // What frames took arrives while others are recorded.
            room.collect(&self.gpu)?;
            glow.collect(&self.gpu)?;
        }
        self.gpu.wait()?;
        room.collect(&self.gpu)?;
        glow.collect(&self.gpu)?;
        let read = |buffer: wgpu::Buffer| {
            let bytes = buffer.slice(..).get_mapped_range();
            Ok(bytes.map_err(|e| Diagnostic::error(format!("can't read: {e}")))?.to_vec())
        };
        under_way.into_iter().map(read).collect()
    }

    fn draw_lamps(&self, encoder: &mut wgpu::CommandEncoder, index: u32) {
        let mut pass = begin(encoder, &self.lamps, wgpu::Color::BLACK);
        pass.set_pipeline(&self.lamps_pipeline);
        pass.draw(0..3, index..index + 1);
    }

    /// One render pass of the program's own over its target.
    fn draw(&self, encoder: &mut wgpu::CommandEncoder, pictures: &[&mut HostPicture]) {
        let mut pass = begin(encoder, &self.target, wgpu::Color { r: 0.02, g: 0.05, b: 0.2, a: 1.0 });
        for picture in pictures {
            pass.set_pipeline(&picture.pipeline);
            pass.set_bind_group(0, &picture.group, &[]);
            pass.set_scissor_rect(picture.place[0], picture.place[1], PICTURE[0], PICTURE[1]);
            pass.draw(0..3, 0..1);
        }
    }

    /// The target's bytes, row by row.
    fn copy(&self, encoder: &mut wgpu::CommandEncoder) -> wgpu::Buffer {
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * SIZE[0] * SIZE[1]),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        // A row is 1024 bytes: a multiple of 256, as copies want it.
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIZE[0]), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(self.target.as_image_copy(), to, self.target.size());
        buffer
    }
}

/// A graph's output in the program's image.
struct HostPicture {
    session: Session,
    /// Whose times have not arrived.
    frames: Vec<Frame>,
    reports: Vec<FrameReport>,
    /// Left and top, in pixels of the program's image.
    place: [u32; 2],
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl HostPicture {
    fn new(
        program: &Program,
        number: u32,
        graph: &str,
        output: &str,
        scene: impl Into<Arc<Scene>>,
    ) -> Checked<HostPicture> {
        let Program { gpu, shaders, target, .. } = program;
        let project = Project::open(Path::new(graph), &[])?;
        let settings = Settings { size: PICTURE, outputs: Some(vec![output.into()]), skip: true, ..Default::default() };
        let session = Session::new(gpu, &project, scene, settings)?;
        // The output stays in this texture for as long as the session lives.
        let Memory::Texture(texture) = session.memory(session.output(output)?)? else {
            return Err(Diagnostic::error("the output is no texture").into());
        };
        let view = texture.create_view(&Default::default());
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
        });
        let place = [4 + number * (SIZE[0] / 2), (SIZE[1] - PICTURE[1]) / 2];
        let constants = [("left", f64::from(place[0])), ("top", f64::from(place[1]))];
        let pipeline = pipeline(&gpu.device, shaders, ("shown", &constants), target.format(), &[Some(&layout)]);
        Ok(HostPicture { session, frames: vec![], reports: vec![], place, pipeline, group })
    }

    /// What has arrived of frames that were submitted, in their order.
    fn collect(&mut self, gpu: &Gpu) -> Checked<()> {
        while let Some(first) = self.frames.first_mut() {
            let Some(report) = first.arrived(gpu)? else { break };
            self.reports.push(report);
            self.frames.remove(0);
        }
        Ok(())
    }
}

fn image(
    device: &wgpu::Device,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    })
}

fn pipeline(
    device: &wgpu::Device,
    shaders: &wgpu::ShaderModule,
    (fragment, constants): (&str, &[(&str, f64)]),
    format: wgpu::TextureFormat,
    bind_group_layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::RenderPipeline {
    let layout = wgpu::PipelineLayoutDescriptor { bind_group_layouts, ..Default::default() };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&device.create_pipeline_layout(&layout)),
        vertex: wgpu::VertexState {
            module: shaders,
            entry_point: Some("corners"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        fragment: Some(wgpu::FragmentState {
            module: shaders,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            targets: &[Some(format.into())],
        }),
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        multiview_mask: None,
        cache: None,
    })
}

/// A render pass over the whole of an image.
fn begin<'e>(encoder: &'e mut wgpu::CommandEncoder, to: &wgpu::Texture, color: wgpu::Color) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &to.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(color), store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    })
}

/// The program's camera: `angle` radians round the middle of the scene, from in front.
fn orbit(scene: &Scene, angle: f32) -> View {
    let (center, distance) = (scene.bounds.center(), 1.5 * scene.bounds.diagonal());
    let back = glam::Vec3::new(angle.sin(), 0.0, angle.cos());
    View::perspective(center + distance * back, -back, glam::Vec3::Y, 0.6)
}

fn write(out: &Path, bytes: &[u8]) -> Checked<()> {
    let fault = |e: &dyn std::fmt::Display| Diagnostic::error(format!("can't write {}: {e}", out.display()));
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(|e| fault(&e))?;
    }
    image::save_buffer(out, bytes, SIZE[0], SIZE[1], image::ColorType::Rgba8).map_err(|e| fault(&e).into())
}

#[test]
fn the_graphs_follow_the_program_from_frame_to_frame() {
    let program = Program::start().unwrap_or_else(|f| panic!("{f}"));
    let mut pictures = program.pictures().unwrap_or_else(|f| panic!("{f}"));
    let frames = program.frames(&mut pictures, 4).unwrap_or_else(|f| panic!("{f}"));
    let pixel = |frame: usize, x: u32, y: u32| {
        let at = 4 * (y * SIZE[0] + x) as usize;
        <[u8; 3]>::try_from(&frames[frame][at..at + 3]).unwrap_or_default()
    };
    // What the program cleared stays round the pictures; its colour is sRGB of (0.02, 0.05, 0.2).
    for (x, y) in [(0, 0), (125, 70), (255, 143)] {
        assert_eq!(pixel(0, x, y), [39, 63, 124], "({x}, {y})");
    }
    let inside = |left: u32| (12..132).flat_map(move |y| (left..left + 120).map(move |x| (x, y)));
    let lit =
        |frame: usize, left: u32| inside(left).filter(|(x, y)| pixel(frame, *x, *y).iter().any(|c| *c > 60)).count();
    let discs = 3.0 * std::f32::consts::PI * 64.0;
    assert!(lit(0, 4) > 2000, "{} pixels of the room are lit", lit(0, 4));
    assert!(lit(3, 132) as f32 > 2.0 * discs, "{} pixels glow", lit(3, 132));
    for left in [4, 132] {
        let other = inside(left).filter(|(x, y)| pixel(2, *x, *y) != pixel(3, *x, *y)).count();
        assert!(other > 300, "{other} pixels change at {left} from one frame to the next");
    }
    for picture in &pictures {
        assert_eq!((picture.frames.len(), picture.reports.len()), (0, 4), "every frame's report arrives");
    }
}
