//! A graph within another program's frame: its device, its camera, its target. The program draws a picture in a picture:
//! two views of a room side by side, with a frame of its own round each. `cargo run --example embed -- out/embed.png`.

use lightgraph::diag::{Checked, Diagnostic};
use lightgraph::gpu::{Gpu, Memory};
use lightgraph::scene::{self, CameraPose, Lens, Scene, View};
use lightgraph::session::{Project, Session, Settings};
use std::path::Path;

/// Of the program's image, in pixels.
const SIZE: [u32; 2] = [256, 144];
/// Of each picture in it.
const PICTURE: [u32; 2] = [120, 120];

/// The program's own shader: a texel of the picture, tone-mapped, where the picture is.
const SHADER: &str = "
@group(0) @binding(0) var picture: texture_2d<f32>;
@vertex fn corners(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}
override left: f32;
override top: f32;
@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let light = textureLoad(picture, vec2u(at.xy - vec2f(left, top)), 0).rgb;
    return vec4f(light / (1.0 + light), 1.0);
}
";

fn main() -> Checked<()> {
    let out = std::env::args().nth(1).unwrap_or_else(|| "out/embed.png".into());
    let program = Program::start()?;
    let mut pictures = [Picture::new(&program, 0)?, Picture::new(&program, 1)?];
    let frames = program.frames(&mut pictures, 3)?;
    write(Path::new(&out), frames.last().map_or(&[], Vec::as_slice))
}

/// A program with a device and a target of its own, as any that draws with wgpu.
struct Program {
    /// How lightgraph sees the device. Both use it, in turn.
    gpu: Gpu,
    target: wgpu::Texture,
}

impl Program {
    fn start() -> Checked<Program> {
        // No debug labels unless `WGPU_DEBUG=1` asks: Mesa's software driver crashes on them in version 22.
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
        let target = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("the program's image"),
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Program { gpu: Gpu::from_parts(adapter, device, queue), target })
    }

    /// The program's loop: its camera moves, the graph renders, the program draws. Bytes of each frame's target.
    fn frames(&self, pictures: &mut [Picture], count: u32) -> Checked<Vec<Vec<u8>>> {
        (0..count)
            .map(|index| {
                for (i, picture) in pictures.iter_mut().enumerate() {
                    let angle = 0.15 * index as f32 + 0.6 * i as f32 - 0.3;
                    picture.session.shift.view = Some(orbit(&picture.session.scene, angle));
                    picture.session.frame(&self.gpu, index, index as f32 / 60.0)?;
                }
                self.draw(pictures);
                self.read()
            })
            .collect()
    }

    /// One render pass of the program's own over its target.
    fn draw(&self, pictures: &[Picture]) {
        let view = self.target.create_view(&Default::default());
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r: 0.02, g: 0.05, b: 0.2, a: 1.0 }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        for picture in pictures {
            pass.set_pipeline(&picture.pipeline);
            pass.set_bind_group(0, &picture.group, &[]);
            pass.set_scissor_rect(picture.place[0], picture.place[1], PICTURE[0], PICTURE[1]);
            pass.draw(0..3, 0..1);
        }
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// The target's bytes, row by row.
    fn read(&self) -> Checked<Vec<u8>> {
        let gpu = &self.gpu;
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * SIZE[0] * SIZE[1]),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        // A row is 1024 bytes: a multiple of 256, as copies want it.
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIZE[0]), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(self.target.as_image_copy(), to, self.target.size());
        gpu.queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |_| ());
        gpu.wait()?;
        let bytes = buffer.slice(..).get_mapped_range().map_err(|e| Diagnostic::error(format!("can't read: {e}")))?;
        Ok(bytes.to_vec())
    }
}

/// A graph's output in the program's image.
struct Picture {
    session: Session,
    /// Left and top, in pixels of the program's image.
    place: [u32; 2],
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Picture {
    fn new(program: &Program, number: u32) -> Checked<Picture> {
        let gpu = &program.gpu;
        let project = Project::open(Path::new("lightgraph:graphs/direct.ron"), &[])?;
        let scene = scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.glb"))?.scene;
        let settings =
            Settings { size: PICTURE, outputs: Some(vec!["direct".into()]), skip: true, ..Default::default() };
        let session = Session::new(gpu, &project, scene, settings)?;
        // The output stays in this texture for as long as the session lives.
        let Memory::Texture(texture) = session.memory(session.output("direct")?)? else {
            return Err(Diagnostic::error("the output is no texture").into());
        };
        let view = texture.create_view(&Default::default());
        let place = [4 + number * (SIZE[0] / 2), (SIZE[1] - PICTURE[1]) / 2];
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
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
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("a picture"),
            layout: Some(&gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                bind_group_layouts: &[Some(&layout)],
                ..Default::default()
            })),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corners"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("shade"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[("left", f64::from(place[0])), ("top", f64::from(place[1]))],
                    ..Default::default()
                },
                targets: &[Some(program.target.format().into())],
            }),
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            multiview_mask: None,
            cache: None,
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
        });
        Ok(Picture { session, place, pipeline, group })
    }
}

/// The program's camera: `angle` radians round the middle of the scene, from in front.
fn orbit(scene: &Scene, angle: f32) -> View {
    let (center, distance) = (scene.bounds.center(), 1.5 * scene.bounds.diagonal());
    let back = glam::Vec3::new(angle.sin(), 0.0, angle.cos());
    View {
        place: CameraPose { position: center + distance * back, forward: -back, up: glam::Vec3::Y },
        lens: Lens::Perspective { yfov: 0.6, near: 0.01, far: None },
    }
}

fn write(out: &Path, bytes: &[u8]) -> Checked<()> {
    let fault = |e: &dyn std::fmt::Display| Diagnostic::error(format!("can't write {}: {e}", out.display()));
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(|e| fault(&e))?;
    }
    image::save_buffer(out, bytes, SIZE[0], SIZE[1], image::ColorType::Rgba8).map_err(|e| fault(&e).into())
}

#[test]
fn the_graph_follows_the_programs_camera_into_the_programs_target() {
    let program = Program::start().unwrap_or_else(|f| panic!("{f}"));
    let mut pictures = [0, 1].map(|i| Picture::new(&program, i).unwrap_or_else(|f| panic!("{f}")));
    let frames = program.frames(&mut pictures, 2).unwrap_or_else(|f| panic!("{f}"));
    let pixel = |frame: usize, x: u32, y: u32| {
        let at = 4 * (y * SIZE[0] + x) as usize;
        <[u8; 3]>::try_from(&frames[frame][at..at + 3]).unwrap_or_default()
    };
    // What the program cleared stays round the pictures; its colour is sRGB of (0.02, 0.05, 0.2).
    for (x, y) in [(0, 0), (125, 70), (255, 143)] {
        assert_eq!(pixel(0, x, y), [39, 63, 124], "({x}, {y})");
    }
    let lit = |frame: usize, left: u32| {
        let inside = (12..132).flat_map(|y| (left..left + 120).map(move |x| (x, y)));
        inside.filter(|(x, y)| pixel(frame, *x, *y).iter().any(|c| *c > 30)).count()
    };
    assert!(lit(0, 4) > 2000 && lit(0, 132) > 2000, "{} and {} lit pixels", lit(0, 4), lit(0, 132));
    let differ = (0..SIZE[1]).flat_map(|y| (0..120).map(move |x| (x, y)));
    let moved = differ.filter(|(x, y)| pixel(0, 4 + x, *y) != pixel(0, 132.min(SIZE[0] - 121) + x, *y)).count();
    assert!(moved > 500, "both pictures show the same view");
    assert_ne!(frames[0], frames[1], "the camera moves from frame to frame");
}
