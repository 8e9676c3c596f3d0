//! Builds small plans by hand, for tests on a device.

use super::{FrameInputs, FrameReport, Gpu, Prepared, execute, prepare, read_buffer, read_image};
use crate::diag::{Checked, Source};
use crate::image::Image;
use crate::plan::*;
use crate::scene::{self, Table, Vertex};
use crate::shader::{BindingKind, Defs, Library, Stage, compose};
use crate::value::Values;
use std::sync::{Arc, LazyLock};

/// The adapter that all tests share. Without one a test fails, and says what to install.
pub fn gpu() -> &'static Gpu {
    static GPU: LazyLock<Gpu> = LazyLock::new(|| match Gpu::open() {
        Ok(gpu) => gpu,
        Err(e) => panic!("{}", crate::diag::Faults::from(e)),
    });
    &GPU
}

/// A plan under construction. Each resource has a slot of its own, with every usage that its format allows.
pub struct Sketch {
    pub plan: Plan,
}

impl Sketch {
    pub fn new() -> Sketch {
        Sketch {
            plan: Plan {
                params: vec![],
                graph: "test.ron".into(),
                values: Values::new(),
                resources: vec![],
                slots: vec![],
                shaders: vec![],
                tables: vec![],
                steps: vec![],
                order: vec![],
                skipped: vec![],
                alternatives: vec![],
                inputs: vec![],
                levels: vec![],
                outputs: vec![],
            },
        }
    }

    fn resource(&mut self, name: &str, desc: Desc, bytes: u64) -> ResourceId {
        let slot = self.plan.slots.len();
        self.plan.slots.push(Slot { desc: desc.clone(), bytes });
        let made = Resource { slot, lifetime: (0, usize::MAX), ..Resource::new(name.into(), desc) };
        self.plan.resources.push(made);
        ResourceId(self.plan.resources.len() - 1)
    }

    pub fn texture(
        &mut self,
        name: &str,
        kind: TextureKind,
        format: wgpu::TextureFormat,
        size: [u32; 3],
    ) -> ResourceId {
        let [width, height, layers] = size;
        use wgpu::TextureUsages as U;
        let ours = U::TEXTURE_BINDING | U::STORAGE_BINDING | U::RENDER_ATTACHMENT | U::COPY_SRC | U::COPY_DST;
        let usage = ours & format.guaranteed_format_features(wgpu::Features::empty()).allowed_usages;
        let desc = TextureDesc { kind, format, width, height, layers, mips: 1, samples: 1, usage, tiles: None };
        let bytes = u64::from(width) * u64::from(height) * u64::from(layers) * 16;
        self.resource(name, Desc::Texture(desc), bytes)
    }

    pub fn image(&mut self, name: &str, format: wgpu::TextureFormat, width: u32, height: u32) -> ResourceId {
        self.texture(name, TextureKind::D2 { array: false }, format, [width, height, 1])
    }

    pub fn buffer(&mut self, name: &str, size: u64) -> ResourceId {
        use wgpu::BufferUsages as U;
        self.resource(name, Desc::Buffer { size, usage: U::STORAGE | U::UNIFORM | U::COPY_SRC | U::COPY_DST }, size)
    }

    pub fn id(&self, name: &str) -> ResourceId {
        ResourceId(self.plan.resources.iter().position(|r| r.name == name).unwrap())
    }

    /// Composes a shader and binds its variables: samplers are linear and clamp, tables and resources go by name.
    fn shader(&mut self, name: &str, wgsl: &str) -> (usize, Vec<Binding>) {
        let path = format!("{name}.wgsl");
        let mut library = Library::default();
        library.files.insert(path.clone(), Source::new(path.clone(), wgsl));
        let shader = compose(&library, &path, &Defs::new(), &[]).unwrap_or_else(|f| panic!("{f}"));
        let mut bindings = vec![];
        for v in &shader.interface.variables {
            bindings.push(match &v.kind {
                BindingKind::Uniform(layout) => Binding::Uniform { layout: layout.clone(), extra: Values::new() },
                BindingKind::Sampler { comparison } => Binding::Sampler(SamplerDesc {
                    filter: wgpu::FilterMode::Linear,
                    address: wgpu::AddressMode::ClampToEdge,
                    compare: comparison.then_some(wgpu::CompareFunction::LessEqual),
                }),
                BindingKind::Storage { element, stride, .. } | BindingKind::UniformArray { element, stride, .. }
                    if scene::table(&v.name).is_some() =>
                {
                    let rows = match &v.kind {
                        BindingKind::UniformArray { size, .. } => Some(size / stride),
                        _ => None,
                    };
                    self.plan.tables.push(TableUse {
                        table: v.name.clone(),
                        row: element.clone(),
                        stride: *stride,
                        rows,
                        texels: false,
                    });
                    Binding::Table(self.plan.tables.len() - 1)
                }
                _ if v.name == "scene_textures" => Binding::SceneTextures,
                _ => Binding::Resource(self.id(&v.name)),
            });
        }
        self.plan.shaders.push(Arc::new(shader));
        (self.plan.shaders.len() - 1, bindings)
    }

    /// Adds a step that is not yet in the order.
    pub fn step(&mut self, name: &str, action: Action, bindings: Vec<Binding>) -> OrderNode {
        self.plan.steps.push(Step {
            name: name.into(),
            pass: name.into(),
            group: None,
            frames: Default::default(),
            action,
            bindings,
            reads: vec![],
            writes: vec![],
            only: None,
            after: vec![],
        });
        OrderNode::Step(StepId(self.plan.steps.len() - 1))
    }

    pub fn compute(&mut self, name: &str, wgsl: &str, groups: [u32; 3]) -> OrderNode {
        let (shader, bindings) = self.shader(name, wgsl);
        let entry = self.plan.shaders[shader].interface.entry(Stage::Compute).unwrap().name.clone();
        self.step(name, Action::Compute { shader, entry, groups, instances: None, indirect: None }, bindings)
    }

    /// A draw to these colour targets (cleared to 0) and this depth buffer (cleared to 1).
    pub fn draw(
        &mut self,
        name: &str,
        wgsl: &str,
        geometry: DrawGeometry,
        targets: (&[&str], Option<&str>),
        places: &[Place],
    ) -> OrderNode {
        let (shader, bindings) = self.shader(name, wgsl);
        let entry = |stage| self.plan.shaders[shader].interface.entry(stage).map(|e| e.name.clone());
        let format = |id: ResourceId| match &self.plan.resources[id.0].desc {
            Desc::Texture(t) => t.format,
            Desc::Buffer { .. } => panic!("not a texture"),
        };
        let color = targets.0.iter().enumerate().map(|(i, target)| {
            let resource = self.id(target);
            let clear = Some([0.0; 4]);
            ColorTarget {
                resource,
                mip: 0,
                location: i as u32,
                format: format(resource),
                clear,
                blend: None,
                resolve: None,
            }
        });
        let draw = Draw {
            shader,
            vertex: entry(Stage::Vertex),
            fragment: entry(Stage::Fragment),
            geometry,
            color: color.collect(),
            depth: targets.1.map(|target| DepthTarget {
                resource: self.id(target),
                format: format(self.id(target)),
                clear: Some(1.0),
                compare: wgpu::CompareFunction::Less,
                write: true,
            }),
            indirect: None,
            members: places.iter().enumerate().map(|(i, p)| DrawMember { index: i as u32, place: *p }).collect(),
            samples: 1,
            views: 1,
            level: None,
        };
        self.step(name, Action::Draw(draw), bindings)
    }

    pub fn screen(&mut self, name: &str, wgsl: &str, target: &str) -> OrderNode {
        self.draw(name, wgsl, DrawGeometry::Screen, (&[target], None), &[Place::Whole])
    }

    pub fn order(mut self, nodes: impl IntoIterator<Item = OrderNode>) -> Plan {
        self.plan.order = nodes.into_iter().collect();
        self.plan
    }
}

/// A prepared plan after one frame.
pub struct Ran {
    pub plan: Plan,
    pub prepared: Prepared,
    pub report: FrameReport,
}

impl Ran {
    pub fn image(&self, name: &str) -> Image {
        read_image(gpu(), &self.prepared, &self.plan, self.id(name)).unwrap_or_else(|f| panic!("{f}"))
    }

    pub fn floats(&self, name: &str) -> Vec<f32> {
        bytemuck::pod_collect_to_vec(&self.bytes(name))
    }

    pub fn words(&self, name: &str) -> Vec<u32> {
        bytemuck::pod_collect_to_vec(&self.bytes(name))
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        read_buffer(gpu(), &self.prepared, &self.plan, self.id(name)).unwrap_or_else(|f| panic!("{f}"))
    }

    fn id(&self, name: &str) -> ResourceId {
        ResourceId(self.plan.resources.iter().position(|r| r.name == name).unwrap())
    }
}

pub fn try_run(plan: Plan, geometry: &scene::Geometry, tables: &[Table]) -> Checked<Ran> {
    let mut prepared = prepare(gpu(), &plan, &scene::Assets::new(geometry, None), tables)?;
    let report = execute(gpu(), &plan, &mut prepared, &FrameInputs::default())?;
    Ok(Ran { plan, prepared, report })
}

pub fn run_scene(plan: Plan, geometry: &scene::Geometry, tables: &[Table]) -> Ran {
    try_run(plan, geometry, tables).unwrap_or_else(|f| panic!("{f}"))
}

pub fn run(plan: Plan) -> Ran {
    run_scene(plan, &scene::Geometry::default(), &[])
}

/// The text of the faults of a plan that must not run.
pub fn faults(plan: Plan) -> String {
    match try_run(plan, &scene::Geometry::default(), &[]) {
        Ok(_) => panic!("it ran"),
        Err(f) => f.to_string(),
    }
}

/// Two quads in clip space, seen as counter-clockwise: the left half at depth 0.5, single sided; over the whole
/// at depth 0.75, seen from behind, double sided.
pub fn quads() -> scene::Geometry {
    let corner = |x: f32, y: f32, z: f32, material: u32| Vertex {
        position: [x, y, z],
        normal: [0.0, 0.0, 1.0],
        uv: [x, y],
        node: 0,
        material,
    };
    let quad = |right: f32, z: f32, material: u32| {
        [
            corner(-1.0, -1.0, z, material),
            corner(right, -1.0, z, material),
            corner(right, 1.0, z, material),
            corner(-1.0, 1.0, z, material),
        ]
    };
    scene::Geometry {
        vertices: [quad(0.0, 0.5, 0), quad(1.0, 0.75, 1)].concat(),
        indices: vec![0, 1, 2, 0, 2, 3, 4, 6, 5, 4, 7, 6],
        one_sided: 6,
        ..scene::Geometry::default()
    }
}
