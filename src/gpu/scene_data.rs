//! Uploads the scene: vertices, indices, tables in the layout that shaders ask for, textures of materials. At the
//! start of a frame the device writes the members of tables that are in world space, and the texels of tables.

use super::{
    buffers::filled, device::Gpu, recorder::Recorder, scope::scoped, upload::write_levels, world_space::WorldSpace,
};
use crate::content::hash;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::tables::{ACROSS, TEXEL, has_derived, pack, stride, write_rows};
use crate::plan::{Plan, TableUse};
use crate::scene::{Assets, Geometry, Level, Table, TextureArray};
use std::ops::Range;
use std::sync::Arc;

/// The uploaded scene.
#[derive(Debug)]
pub(super) struct SceneData {
    /// `None` without triangles.
    pub mesh: Option<Mesh>,
    /// By the index in [`Plan::tables`].
    pub tables: Vec<TableMemory>,
    /// What those hold.
    uploaded: Vec<Table>,
    /// `None` where no shader reads what the device derives.
    world_space: Option<WorldSpace>,
    /// A 2D array; one white texel when the scene has no textures.
    pub textures: wgpu::TextureView,
}

/// A table on the device.
#[derive(Debug)]
pub(super) struct TableMemory {
    pub buffer: wgpu::Buffer,
    /// A copy of the buffer in whole lines, which shaders read in its place.
    pub texels: Option<(wgpu::Texture, wgpu::TextureView)>,
    /// Rows that the device has yet to transform and to copy to texels, sorted.
    pub dirty: Vec<Range<usize>>,
}

/// Triangles.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    pub vertices: wgpu::Buffer,
    /// By vertex; one for all, where they have none.
    pub tangents: wgpu::Buffer,
    /// 32 bits each.
    pub indices: wgpu::Buffer,
    /// Of the scene as it is.
    pub whole: MeshPart,
    /// Of its levels, in the plan's order.
    pub levels: Vec<MeshPart>,
}

/// Indices of a mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeshPart {
    pub first: u32,
    pub count: u32,
    /// The first so many belong to single-sided materials.
    pub one_sided: u32,
}

impl SceneData {
    /// Uploads everything that the plan's shaders may ask for. Triangles and textures that the device keeps of an
    /// earlier plan are used again.
    ///
    /// # Errors
    /// A table that the scene lacks or that lacks a column; sizes beyond the device's limits; texture data that do not
    /// fit their size.
    pub(super) fn upload(gpu: &Gpu, plan: &Plan, assets: &Assets<'_>, tables: &[Table]) -> Checked<SceneData> {
        let mut faults = vec![];
        let mut keep = |f: Faults| faults.extend(f.0);
        let levels: Vec<u128> = assets.levels.iter().map(|l| l.taken.key()).collect();
        let content = hash(&(assets.hashes.geometry, levels));
        let mesh = gpu.caches.meshes.get(&content, || Mesh::upload(gpu, assets.geometry, assets.levels));
        let mesh = mesh.map_err(&mut keep).ok();
        let views = gpu.caches.textures.get(&assets.hashes.textures, || upload_textures(gpu, assets.textures));
        let views = views.map_err(&mut keep).ok();
        let (mut memories, mut uploaded) = (vec![], vec![]);
        for wanted in &plan.tables {
            let memory = find(wanted, tables).and_then(|t| {
                let memory = TableMemory::of(gpu, wanted, t)?;
                uploaded.push(t.clone());
                Ok(memory)
            });
            memories.extend(memory.map_err(&mut keep).ok());
        }
        match (mesh, views) {
            (Some(mesh), Some(textures)) if faults.is_empty() => {
                let mut data = SceneData { mesh, tables: memories, uploaded, world_space: None, textures };
                data.prepare_world_space(gpu, plan)?;
                Ok(data)
            }
            _ => Err(Faults(faults)),
        }
    }

    /// Prepares for what the device writes.
    fn prepare_world_space(&mut self, gpu: &Gpu, plan: &Plan) -> Checked<()> {
        let uses = || plan.tables.iter().zip(&self.uploaded).zip(&self.tables);
        self.world_space = WorldSpace::prepare(gpu, self.mesh.as_ref(), uses)?;
        Ok(())
    }

    /// Uploads changed tables. True when one needed new memory: what binds it must be bound again.
    ///
    /// # Errors
    /// As [`SceneData::upload`].
    pub(super) fn update(&mut self, gpu: &Gpu, plan: &Plan, changed: &[Table]) -> Checked<bool> {
        let (mut moved, mut other) = (false, false);
        for ((wanted, memory), held) in plan.tables.iter().zip(&mut self.tables).zip(&mut self.uploaded) {
            let Some(table) = changed.iter().find(|t| t.name == wanted.table) else { continue };
            let before = std::mem::replace(held, table.clone());
            if let Some(ranges) = table.differs(&before) {
                for some in ranges {
                    memory.write_rows(gpu, wanted, table, some.clone())?;
                    memory.dirty.push(some);
                }
                memory.dirty.sort_by_key(|rows| rows.start);
                continue;
            }
            other |= table.places().is_some();
            let bytes = pack(wanted, table)?;
            // The same size exactly: a shader may ask for the length of the array.
            if bytes.len() as u64 == memory.buffer.size() {
                gpu.queue.write_buffer(&memory.buffer, 0, &bytes);
                memory.dirty = std::iter::once(0..table.rows).collect();
            } else {
                *memory = TableMemory::of(gpu, wanted, table)?;
                moved = true;
            }
        }
        match &mut self.world_space {
            _ if other || moved => self.prepare_world_space(gpu, plan)?,
            Some(world_space) => world_space.follow(gpu, changed),
            None => {}
        }
        Ok(moved)
    }

    /// Writes what follows from nodes to changed rows, then copies changed rows to texels.
    pub(super) fn encode(&self, gpu: &Gpu, plan: &Plan, record: &mut Recorder<'_>) {
        if let Some(world_space) = &self.world_space {
            world_space.encode(gpu, record, &self.tables);
        }
        for (wanted, memory) in plan.tables.iter().zip(&self.tables) {
            memory.copy_texels(record, stride(wanted) as u64);
        }
    }

    /// Notes that the device got what was encoded.
    pub(super) fn encoded(&mut self) {
        self.tables.iter_mut().for_each(|memory| memory.dirty.clear());
        self.world_space.iter_mut().for_each(WorldSpace::encoded);
    }
}

impl TableMemory {
    fn of(gpu: &Gpu, wanted: &TableUse, table: &Table) -> Checked<TableMemory> {
        use wgpu::BufferUsages as U;
        let (name, bytes) = (&wanted.table, pack(wanted, table)?);
        let texels = if wanted.texels { Some(lines(gpu, name, bytes.len())?) } else { None };
        let usage = match wanted.texels {
            false => U::STORAGE | U::UNIFORM,
            true if has_derived(wanted, table) => U::STORAGE | U::COPY_SRC,
            true => U::COPY_SRC,
        };
        let buffer = filled(gpu, &format!("rows of the table `{name}`"), &[&bytes], usage)?;
        Ok(TableMemory { buffer, texels, dirty: std::iter::once(0..table.rows).collect() })
    }

    /// Packs and writes some rows.
    fn write_rows(&self, gpu: &Gpu, wanted: &TableUse, table: &Table, some: Range<usize>) -> Checked<()> {
        // Nothing else of such a row changes while the nodes and triangles are the same.
        if has_derived(wanted, table) {
            return Ok(());
        }
        let stride = stride(wanted);
        let mut bytes = vec![0; stride * some.len()];
        write_rows(wanted, table, some.clone(), &mut bytes)?;
        gpu.queue.write_buffer(&self.buffer, (stride * some.start) as u64, &bytes);
        Ok(())
    }

    /// Copies the lines that hold changed rows of `stride` bytes each.
    fn copy_texels(&self, record: &mut Recorder<'_>, stride: u64) {
        let Some((texture, _)) = &self.texels else { return };
        let line = u64::from(ACROSS) * TEXEL as u64;
        let mut done = 0;
        for rows in self.dirty.iter().filter(|rows| !rows.is_empty()) {
            let (first, end) = (rows.start as u64 * stride / line, (rows.end as u64 * stride).div_ceil(line));
            let first = first.max(done);
            if first >= end {
                continue;
            }
            done = end;
            let bytes_per_row = Some(line as u32);
            let layout = wgpu::TexelCopyBufferLayout { offset: first * line, bytes_per_row, rows_per_image: None };
            let origin = wgpu::Origin3d { x: 0, y: first as u32, z: 0 };
            record.encoder().copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo { buffer: &self.buffer, layout },
                wgpu::TexelCopyTextureInfo { origin, ..texture.as_image_copy() },
                wgpu::Extent3d { width: ACROSS, height: (end - first) as u32, depth_or_array_layers: 1 },
            );
        }
    }
}

impl Mesh {
    fn upload(gpu: &Gpu, geometry: &Geometry, levels: &[Arc<Level>]) -> Checked<Option<Mesh>> {
        use wgpu::BufferUsages as U;
        if geometry.indices.is_empty() || geometry.vertices.is_empty() {
            return Ok(None);
        }
        let mut parts = vec![];
        let mut end = 0u32;
        let all = std::iter::once((&geometry.indices, geometry.one_sided));
        for (indices, one_sided) in all.chain(levels.iter().map(|l| (&l.indices, l.one_sided))) {
            let many = || Diagnostic::error(format!("{} more indices are too many", indices.len()));
            let count = u32::try_from(indices.len()).map_err(|_| many())?;
            parts.push(MeshPart { first: end, count, one_sided: one_sided.min(count) });
            end = end.checked_add(count).ok_or_else(many)?;
        }
        let vertices: &[u8] = bytemuck::cast_slice(&geometry.vertices);
        let all = &geometry.more.tangents;
        let tangents = if all.is_empty() { &[geometry.more.tangent(0)] } else { all.as_slice() };
        let lists = std::iter::once(&geometry.indices).chain(levels.iter().map(|l| &l.indices));
        let lists: Vec<&[u8]> = lists.map(|indices| bytemuck::cast_slice(indices)).collect();
        Ok(Some(Mesh {
            vertices: filled(gpu, "vertices", &[vertices], U::VERTEX | U::STORAGE)?,
            tangents: filled(gpu, "tangents", &[bytemuck::cast_slice(tangents)], U::STORAGE)?,
            indices: filled(gpu, "indices", &lists, U::INDEX)?,
            whole: parts.remove(0),
            levels: parts,
        }))
    }

    /// What a draw of this level draws; `None`: of the scene as it is.
    pub(super) fn part(&self, level: Option<usize>) -> MeshPart {
        level.and_then(|i| self.levels.get(i)).copied().unwrap_or(self.whole)
    }
}

fn find<'a>(wanted: &TableUse, tables: &'a [Table]) -> Checked<&'a Table> {
    tables.iter().find(|t| t.name == wanted.table).ok_or_else(|| {
        Diagnostic::error(format!("the scene has no table `{}`", wanted.table))
            .nearest(&wanted.table, tables.iter().map(|t| t.name))
            .into()
    })
}

/// A texture of whole lines, for so many bytes.
fn lines(gpu: &Gpu, name: &str, bytes: usize) -> Checked<(wgpu::Texture, wgpu::TextureView)> {
    let (ours, most) = (bytes / (ACROSS as usize * TEXEL), gpu.limits.max_texture_dimension_2d);
    let height = u32::try_from(ours).ok().filter(|height| ACROSS.max(*height) <= most).ok_or_else(|| {
        let ours = format!("table `{name}` takes {ours} lines of {ACROSS} texels");
        Diagnostic::error(format!("{ours}, and this device allows {most} each way")).help("use a smaller scene")
    })?;
    scoped(gpu, &format!("upload `{name}`"), || {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d { width: ACROSS, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        (texture, view)
    })
}

fn upload_textures(gpu: &Gpu, textures: Option<&TextureArray>) -> Checked<wgpu::TextureView> {
    let white = TextureArray { width: 1, height: 1, layers: 1, mips: vec![vec![255; 4]] };
    let t = textures.unwrap_or(&white);
    let limits = &gpu.limits;
    for (what, ours, most) in [
        ("width", t.width, limits.max_texture_dimension_2d),
        ("height", t.height, limits.max_texture_dimension_2d),
        ("number", t.layers, limits.max_texture_array_layers),
    ] {
        if ours > most || ours == 0 {
            return Err(Diagnostic::error(format!(
                "the {what} of the scene's textures is {ours}, and this device allows 1 to {most}"
            ))
            .help("use fewer or smaller textures")
            .into());
        }
    }
    let mip = |level: usize| {
        let across = |edge: u32| edge.checked_shr(level as u32).unwrap_or(0).max(1);
        wgpu::Extent3d { width: across(t.width), height: across(t.height), depth_or_array_layers: t.layers }
    };
    for (level, bytes) in t.mips.iter().enumerate() {
        let e = mip(level);
        let want = 4 * u64::from(e.width) * u64::from(e.height) * u64::from(e.depth_or_array_layers);
        if bytes.len() as u64 != want {
            return Err(Diagnostic::error(format!(
                "mip level {level} of the scene's textures has {} bytes, not {want}",
                bytes.len()
            ))
            .into());
        }
    }
    scoped(gpu, "upload the scene's textures", || {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("scene_textures"),
            size: mip(0),
            mip_level_count: t.mips.len().max(1) as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        write_levels(gpu, &texture, &t.mips);
        texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        })
    })
}
