//! Frames that are recorded into a program's own commands: they wait for nothing, equal those that are waited for, and
//! read the program's own memory.

use crate::{device, support};
use glam::Vec3;
use lightgraph::internals::gpu::PendingImage;
use lightgraph::internals::plan::change::Why;
use lightgraph::{Frame, FrameReport, Gpu, Image, Project, Scene, Session, Settings};
use std::collections::VecDeque;
use std::fs;

/// Frames that are recorded before the first is asked for.
const IN_FLIGHT: usize = 3;

fn open(gpu: &Gpu, graph: &str, set: &[&str], settings: Settings) -> Session {
    let project = Project::open(&support::repository("graphs/gi").join(graph), &[]).unwrap_or_else(|f| panic!("{f}"));
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let params = project.params(&set).unwrap_or_else(|f| panic!("{f}"));
    let loaded = Scene::load(&support::repository("scenes/hall.ron")).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { params, size: [16, 12], skip: true, ..settings };
    Session::new(gpu, &project, loaded.scene, settings).unwrap_or_else(|f| panic!("{f}"))
}

fn encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device.create_command_encoder(&Default::default())
}

/// What arrives of a frame. It polls as a program's own loop does.
fn arrive(gpu: &Gpu, recorded: &mut Frame, image: &mut PendingImage) -> (FrameReport, Image) {
    let (mut report, mut picture) = (None, None);
    for _ in 0..1_000_000 {
        report = report.or_else(|| recorded.arrived(gpu).unwrap_or_else(|f| panic!("{f}")));
        picture = picture.or_else(|| image.arrived(gpu).unwrap_or_else(|f| panic!("{f}")));
        if report.is_some() && picture.is_some() {
            break;
        }
        std::thread::yield_now();
    }
    (report.expect("the report does not arrive"), picture.expect("the image does not arrive"))
}

/// An object that wanders, a camera that looks round, and now and then a frame in which nothing moves.
fn move_on(session: &mut Session, frame: u32) {
    let step = (frame - frame / 5) as f32;
    let at = 0.2 * Vec3::new((0.31 * step).sin(), 0.0, (0.17 * step).cos());
    let ball = session.scene.nodes.iter().position(|n| n.name == "ball").expect("the hall has a ball");
    session.shift.nodes = vec![(ball, at)];
    if frame.is_multiple_of(3) {
        session.shift.cameras = 0.1 * Vec3::new((0.11 * step).sin(), 0.0, 0.0);
    }
}

/// A step that ran, how often, and for how many instances.
type Ran = (usize, u32, Option<u32>);

/// The bits of the texels, and what ran.
fn facts(report: &FrameReport, image: &Image) -> (Vec<u32>, Vec<Ran>) {
    let steps = report.steps.iter().map(|s| (s.step, s.runs, s.instances)).collect();
    (image.data.iter().map(|x| x.to_bits()).collect(), steps)
}

#[test]
fn recorded_frames_in_flight_equal_those_that_are_waited_for() {
    let gpu = &*device::gpu();
    let cases: [(&str, &[&str], u32); 2] = [("direct.ron", &[], 900), ("fast_grid.ron", &["grid=2", "face=8"], 100)];
    for (graph, set, frames) in cases {
        let settings = Settings { outputs: Some(vec!["color".into()]), ..Settings::default() };
        let mut waited = open(gpu, graph, set, settings.clone());
        let mut recorded = open(gpu, graph, set, settings);
        let mut wanted = VecDeque::new();
        let mut flying = VecDeque::new();
        let mut images = std::collections::BTreeSet::new();
        for frame in 0..frames + IN_FLIGHT as u32 {
            if frame < frames {
                let time = frame as f32 / 60.0;
                move_on(&mut waited, frame);
                move_on(&mut recorded, frame);
                let report = waited.frame(gpu, frame, time).unwrap_or_else(|f| panic!("{f}"));
                let image = waited.image(gpu, "color").unwrap_or_else(|f| panic!("{f}"));
                wanted.push_back(facts(&report, &image));

                let polls = gpu.polls();
                let mut commands = encoder(gpu);
                let later = recorded.record(gpu, &mut commands, frame, time).unwrap_or_else(|f| panic!("{f}"));
                let image = recorded.image_later(gpu, &mut commands, "color").unwrap_or_else(|f| panic!("{f}"));
                gpu.queue.submit([commands.finish()]);
                assert_eq!(gpu.polls(), polls, "{graph}: frame {frame} polls or waits before it is submitted");
                flying.push_back((later, image));
            }
            if frame >= IN_FLIGHT as u32
                && let Some((mut later, mut image)) = flying.pop_front()
            {
                let (report, image) = arrive(gpu, &mut later, &mut image);
                let found = facts(&report, &image);
                let wanted = wanted.pop_front().expect("as many frames are waited for");
                assert_eq!(found.1, wanted.1, "{graph}, frame {}: the steps", frame - IN_FLIGHT as u32);
                assert!(found.0 == wanted.0, "{graph}, frame {}: the image differs", frame - IN_FLIGHT as u32);
                images.insert(found.0);
            }
        }
        assert!(images.len() as u32 > frames / 2, "{graph}: {} different images", images.len());
    }
}

#[test]
fn what_has_to_wait_is_not_recorded() {
    let gpu = &*device::gpu();
    let cases = [
        (Settings { verify: true, ..Settings::default() }, "leave out `verify`"),
        (Settings { watch: true, ..Settings::default() }, "`Session::frame`"),
    ];
    for (settings, remedy) in cases {
        let mut session = open(gpu, "direct.ron", &[], settings);
        let fault = session.record(gpu, &mut encoder(gpu), 0, 0.0).expect_err("it waits");
        assert!(fault.to_string().contains(remedy), "{fault}");
    }
}

/// A texture of the program's, two numbers and a buffer, through a graph that doubles and adds.
const GRAPH: &str = r#"Graph(
    about: "Reads what another program lends",
    inputs: {"light": Texture(format: Rgba32Float, size: (4, 2)), "gain": Buffer(stride: 4, count: 2)},
    resources: {
        "still": Texture(format: Rgba32Float, size: (4, 2)),
        "color": Texture(format: Rgba32Float, size: (4, 2)),
    },
    passes: [
        Screen(name: "pattern", shader: "pattern.wgsl", color: "still"),
        Screen(name: "scale", shader: "scale.wgsl", color: "color"),
    ],
    outputs: {"color": "color"},
)"#;

const PATTERN: &str = "@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f { return vec4f(at.x); }";

const SCALE: &str = "
var light: texture_2d<f32>;
var still: texture_2d<f32>;
var<storage, read> gain: array<f32, 2>;
@fragment fn shade(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return gain[0] * textureLoad(light, vec2u(at.xy), 0) + gain[1] * textureLoad(still, vec2u(at.xy), 0);
}";

fn texture(gpu: &Gpu, format: wgpu::TextureFormat, usage: wgpu::TextureUsages, size: [u32; 2]) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

fn fill(gpu: &Gpu, texture: &wgpu::Texture, light: f32) {
    let bytes: Vec<u8> = std::iter::repeat_n(light.to_le_bytes(), 32).flatten().collect();
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(64), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
}

fn buffer(gpu: &Gpu, numbers: &[f32]) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 4 * numbers.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    gpu.queue.write_buffer(&buffer, 0, &bytes);
    buffer
}

#[test]
fn a_program_lends_its_textures_and_buffers() {
    use wgpu::TextureUsages as Usage;
    let gpu = &*device::gpu();
    let scratch = support::Scratch::new("lent");
    fs::create_dir_all(scratch.path().join("shaders")).unwrap();
    for (name, text) in [("graph.ron", GRAPH), ("shaders/pattern.wgsl", PATTERN), ("shaders/scale.wgsl", SCALE)] {
        fs::write(scratch.path().join(name), text).unwrap();
    }
    let project = Project::open(&scratch.path().join("graph.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let settings = Settings { size: [16, 12], skip: true, verify: true, ..Settings::default() };
    let scene = std::sync::Arc::new(Scene::stand_in().unwrap_or_else(|f| panic!("{f}")).scene);
    let mut session = Session::new(gpu, &project, scene.clone(), settings.clone()).unwrap_or_else(|f| panic!("{f}"));
    let ran = |session: &mut Session| -> (f32, Vec<bool>) {
        session.frame(gpu, 0, 0.0).unwrap_or_else(|f| panic!("{f}"));
        let image = session.image(gpu, "color").unwrap_or_else(|f| panic!("{f}"));
        (image.data[0], session.why().iter().map(Why::runs).collect())
    };
    // Blank until something is lent.
    assert_eq!(ran(&mut session), (0.0, vec![true, true]));

    let all = Usage::TEXTURE_BINDING | Usage::COPY_DST | Usage::COPY_SRC;
    let light = texture(gpu, wgpu::TextureFormat::Rgba32Float, all, [4, 2]);
    let gain = buffer(gpu, &[2.0, 10.0]);
    fill(gpu, &light, 3.0);
    let lend = |session: &mut Session, light: &wgpu::Texture, version| {
        session.import(gpu, "light", light.clone(), version).unwrap_or_else(|f| panic!("{f}"));
    };
    lend(&mut session, &light, 0);
    session.import(gpu, "gain", gain.clone(), 0).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(ran(&mut session), (11.0, vec![false, true]), "2 × 3 + 10 × 0.5");

    // The version alone says what is new.
    lend(&mut session, &light, 0);
    assert_eq!(ran(&mut session), (11.0, vec![false, false]));
    fill(gpu, &light, 4.0);
    lend(&mut session, &light, 1);
    assert_eq!(ran(&mut session), (13.0, vec![false, true]));
    let other = texture(gpu, wgpu::TextureFormat::Rgba32Float, all, [4, 2]);
    fill(gpu, &other, 5.0);
    lend(&mut session, &other, 1);
    assert_eq!(ran(&mut session), (15.0, vec![false, true]), "other memory is new whatever its version");
    lend(&mut session, &light, 1);
    assert_eq!(ran(&mut session), (13.0, vec![false, true]), "and so is the old one again");

    // What does not fit is refused, and what was lent stays.
    let sampled = wgpu::TextureFormat::Rgba32Float;
    let unfit = [
        (texture(gpu, wgpu::TextureFormat::Rgba16Float, all, [4, 2]), "of the format Rgba16Float"),
        (texture(gpu, sampled, all, [4, 3]), "4 × 3 × 1"),
        (texture(gpu, sampled, Usage::COPY_DST, [4, 2]), "a texture for TextureUsages(COPY_DST)"),
    ];
    for (memory, why) in unfit {
        let fault = session.import(gpu, "light", memory, 7).expect_err("it does not fit").to_string();
        assert!(fault.contains("what is lent as `light`") && fault.contains(why), "{fault}");
    }
    for (input, why) in [("gain", "a texture"), ("lihgt", "`light`"), ("still", "takes nothing from outside")] {
        let fault = session.import(gpu, input, light.clone(), 7).expect_err("it does not fit").to_string();
        assert!(fault.contains(why), "{fault}");
    }
    let fault = session.import(gpu, "gain", buffer(gpu, &[1.0]), 7).expect_err("it does not fit").to_string();
    assert!(fault.contains("a buffer of 4 bytes"), "{fault}");
    assert_eq!(ran(&mut session), (13.0, vec![false, false]));

    // A session that takes over takes what was lent along; one whose input has another size says that it lost it.
    let mut after = Session::after(gpu, &project, scene.clone(), settings.clone(), Some(&session))
        .unwrap_or_else(|f| panic!("{f}"));
    assert!(after.notices.is_empty(), "{:?}", after.notices);
    assert_eq!(ran(&mut after), (13.0, vec![false, false]));
    let wider = GRAPH.replacen(
        "\"light\": Texture(format: Rgba32Float, size: (4, 2))",
        "\"light\": Texture(format: Rgba32Float, size: (5, 2))",
        1,
    );
    assert_ne!(wider, GRAPH);
    fs::write(scratch.path().join("graph.ron"), wider).unwrap();
    let project = Project::open(&scratch.path().join("graph.ron"), &[]).unwrap_or_else(|f| panic!("{f}"));
    let mut wider =
        Session::after(gpu, &project, scene.clone(), settings, Some(&after)).unwrap_or_else(|f| panic!("{f}"));
    let said: Vec<String> = wider.notices.iter().map(|n| n.message.clone()).collect();
    assert_eq!(said, ["what was lent as `light` does not serve the changed graph"]);
    assert_eq!(ran(&mut wider).0, 5.0, "10 × 0.5");
}
