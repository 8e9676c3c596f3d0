//! Uploads the scene: vertices, indices, tables in the layout that shaders ask for, textures of materials.

use super::{device::Gpu, scope::scoped, upload::write_levels};
use crate::content::hash;
use crate::diag::{Checked, Diagnostic, Faults};
use crate::plan::tables::{ACROSS, Rows, TEXEL, pack, stride};
use crate::plan::{Plan, TableUse};
use crate::scene::{Assets, Geometry, Level, Table, TextureArray};
use std::ops::Range;
use std::sync::Arc;

/// Bytes of rows that are packed before they go to the device's memory: they stay in the processor's caches.
const BLOCK: usize = 1 << 15;

/// The uploaded scene.
#[derive(Debug)]
pub(super) struct SceneData {
    /// `None` without triangles.
    pub mesh: Option<Mesh>,
    /// By the index in [`Plan::tables`].
    pub tables: Vec<TableMemory>,
    /// What those hold.
    uploaded: Vec<Table>,
    /// A 2D array; one white texel when the scene has no textures.
    pub textures: wgpu::TextureView,
}

/// A table on the device.
#[derive(Debug)]
pub(super) enum TableMemory {
    Rows(wgpu::Buffer),
    Texels(wgpu::Texture, wgpu::TextureView),
}

/// Triangles.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    pub vertices: wgpu::Buffer,
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
                let memory = TableMemory::of(gpu, wanted, &pack(wanted, t)?)?;
                uploaded.push(t.clone());
                Ok(memory)
            });
            memories.extend(memory.map_err(&mut keep).ok());
        }
        match (mesh, views) {
            (Some(mesh), Some(textures)) if faults.is_empty() => {
                Ok(SceneData { mesh, tables: memories, uploaded, textures })
            }
            _ => Err(Faults(faults)),
        }
    }

    /// Uploads changed tables. True when one needed new memory: what binds it must be bound again.
    ///
    /// # Errors
    /// As [`SceneData::upload`].
    pub(super) fn update(&mut self, gpu: &Gpu, plan: &Plan, changed: &[Table]) -> Checked<bool> {
        let mut moved = false;
        for ((wanted, memory), held) in plan.tables.iter().zip(&mut self.tables).zip(&mut self.uploaded) {
            let Some(table) = changed.iter().find(|t| t.name == wanted.table) else { continue };
            let before = std::mem::replace(held, table.clone());
            if let Some(ranges) = table.differs(&before) {
                ranges.into_iter().try_for_each(|some| memory.write_rows(gpu, wanted, table, some))?;
                continue;
            }
            let bytes = pack(wanted, table)?;
            // The same size exactly: a shader may ask for the length of the array.
            if bytes.len() as u64 == memory.size() {
                memory.write(gpu, 0, &bytes);
            } else {
                *memory = TableMemory::of(gpu, wanted, &bytes)?;
                moved = true;
            }
        }
        Ok(moved)
    }
}

impl TableMemory {
    fn of(gpu: &Gpu, wanted: &TableUse, bytes: &[u8]) -> Checked<TableMemory> {
        if wanted.texels { lines(gpu, &wanted.table, bytes) } else { storage(gpu, &wanted.table, bytes) }
    }

    /// In bytes.
    fn size(&self) -> u64 {
        match self {
            TableMemory::Rows(buffer) => buffer.size(),
            TableMemory::Texels(texture, _) => u64::from(texture.width()) * u64::from(texture.height()) * TEXEL as u64,
        }
    }

    /// Packs and writes some rows.
    fn write_rows(&self, gpu: &Gpu, wanted: &TableUse, table: &Table, some: Range<usize>) -> Checked<()> {
        let (stride, rows, Range { start, end }) = (stride(wanted), Rows::new(wanted, table, some.clone()), some);
        let at = |row: usize| (stride * row) as u64;
        let TableMemory::Rows(buffer) = self else {
            let mut bytes = vec![0; stride * (end - start)];
            rows.write(start..end, &mut bytes)?;
            self.write(gpu, at(start), &bytes);
            return Ok(());
        };
        let size = wgpu::BufferSize::new(at(end) - at(start));
        let view = size.and_then(|size| gpu.queue.write_buffer_with(buffer, at(start), size));
        let Some(mut view) = view else { return Ok(()) };
        let many = (BLOCK / stride).max(1).min(end - start);
        let mut block = vec![0; stride * many];
        for first in (start..end).step_by(many) {
            let some = first..end.min(first + many);
            let bytes = &mut block[..stride * some.len()];
            rows.write(some, bytes)?;
            view.slice(stride * (first - start)..).slice(..bytes.len()).copy_from_slice(bytes);
        }
        Ok(())
    }

    /// Writes bytes from byte number `at` on; of texels whole ones.
    fn write(&self, gpu: &Gpu, at: u64, bytes: &[u8]) {
        let texture = match self {
            TableMemory::Rows(buffer) => return gpu.queue.write_buffer(buffer, at, bytes),
            TableMemory::Texels(texture, _) => texture,
        };
        let (mut at, mut bytes) = (at / TEXEL as u64, bytes);
        while !bytes.is_empty() {
            let (x, y) = ((at % u64::from(ACROSS)) as u32, (at / u64::from(ACROSS)) as u32);
            let left = (bytes.len() / TEXEL) as u32;
            let (width, height) =
                if x == 0 && left >= ACROSS { (ACROSS, left / ACROSS) } else { (left.min(ACROSS - x), 1) };
            let (now, later) = bytes.split_at(width as usize * height as usize * TEXEL);
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z: 0 }, ..texture.as_image_copy() },
                now,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(width * TEXEL as u32),
                    rows_per_image: Some(height),
                },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
            at += u64::from(width) * u64::from(height);
            bytes = later;
        }
    }
}

impl Mesh {
    fn upload(gpu: &Gpu, geometry: &Geometry, levels: &[Arc<Level>]) -> Checked<Option<Mesh>> {
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
        let lists = std::iter::once(&geometry.indices).chain(levels.iter().map(|l| &l.indices));
        let lists: Vec<&[u8]> = lists.map(|indices| bytemuck::cast_slice(indices)).collect();
        Ok(Some(Mesh {
            vertices: buffer(gpu, "vertices", &[vertices], wgpu::BufferUsages::VERTEX)?,
            indices: buffer(gpu, "indices", &lists, wgpu::BufferUsages::INDEX)?,
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

fn lines(gpu: &Gpu, name: &str, bytes: &[u8]) -> Checked<TableMemory> {
    let (ours, most) = (bytes.len() / (ACROSS as usize * TEXEL), gpu.limits.max_texture_dimension_2d);
    let height = u32::try_from(ours).ok().filter(|height| ACROSS.max(*height) <= most).ok_or_else(|| {
        let ours = format!("table `{name}` takes {ours} lines of {ACROSS} texels");
        Diagnostic::error(format!("{ours}, and this device allows {most} each way")).help("use a smaller scene")
    })?;
    let memory = scoped(gpu, &format!("upload `{name}`"), || {
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
        let memory = TableMemory::Texels(texture, view);
        memory.write(gpu, 0, bytes);
        memory
    })?;
    Ok(memory)
}

fn storage(gpu: &Gpu, name: &str, bytes: &[u8]) -> Checked<TableMemory> {
    let (ours, most) = (bytes.len() as u64, gpu.limits.max_storage_buffer_binding_size);
    if ours > most {
        return Err(Diagnostic::error(format!("table `{name}` takes {ours} bytes, and this device allows {most}"))
            .help("use a smaller scene")
            .into());
    }
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::UNIFORM;
    Ok(TableMemory::Rows(buffer(gpu, name, &[bytes], usage)?))
}

/// A buffer of one piece of bytes after the other.
fn buffer(gpu: &Gpu, label: &str, pieces: &[&[u8]], usage: wgpu::BufferUsages) -> Checked<wgpu::Buffer> {
    let (ours, most) = (pieces.iter().map(|bytes| bytes.len() as u64).sum(), gpu.limits.max_buffer_size);
    if ours > most {
        return Err(Diagnostic::error(format!("the {label} take {ours} bytes, and this device allows {most}"))
            .help("use a smaller scene")
            .into());
    }
    scoped(gpu, &format!("upload `{label}`"), || {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: ours,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut at = 0;
        for bytes in pieces {
            gpu.queue.write_buffer(&buffer, at, bytes);
            at += bytes.len() as u64;
        }
        buffer
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
