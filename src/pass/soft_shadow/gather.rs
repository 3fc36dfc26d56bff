//! In image space: the hard test, the list of tiles that may hold a penumbra, the search for its radius there, and the blur.

use super::{Gathered, OccluderTest, OneLight, PenumbraSearch, ShadowMethod, ShadowTarget, SoftShadowInputs};
use crate::gpu::{self as device, BindGroupCache, Bound, ComputeSpec, Slot};
use crate::resource::PendingPenumbrae;
#[cfg(feature = "bvh")]
use crate::resource::bvh_geometry::BVH_SLOTS;
use crate::resource::pending_penumbrae::tile_counts;
use crate::{Error, wgsl};
use std::sync::OnceLock;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `TileList` in `shaders/pass/soft_shadow/tiles.wgsl`, with the first of them.
    #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct TileList {
        pub(crate) workgroups: [u32; 3],
        pub(crate) count: u32,
        pub(crate) tiles: [u32; 1],
    }
}

const R32_FLOAT: Slot = Slot::StorageTexture(wgpu::TextureFormat::R32Float);

/// Bindings of group 0 of `shaders/pass/soft_shadow/test_light.wgsl`, in order.
pub(crate) const TEST_SLOTS: [Slot; 11] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    R32_FLOAT,
    R32_FLOAT,
    R32_FLOAT,
    Slot::StorageMut,
];

/// Group 1, where shadow maps are read.
pub(crate) const MAP_SLOTS: [Slot; 1] = [Slot::UintArray];

/// Bindings of `shaders/pass/soft_shadow/list_tiles.wgsl`, in order.
pub(crate) const LIST_SLOTS: [Slot; 3] = [Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// Bindings of `shaders/pass/soft_shadow/flag_tiles.wgsl`, in order.
pub(crate) const FLAG_SLOTS: [Slot; 4] = [Slot::Uniform, Slot::Uniform, Slot::Storage, Slot::StorageMut];

/// Bindings of `shaders/pass/soft_shadow/search_occluders.wgsl`, in order.
pub(crate) const SEARCH_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::Texture,
    Slot::Storage,
    R32_FLOAT,
];

/// Bindings of `shaders/pass/soft_shadow/blur_axis.wgsl` and `blur_disc.wgsl`, in order.
pub(crate) const BLUR_SLOTS: [Slot; 9] = [
    Slot::Uniform,
    Slot::Uniform,
    Slot::Texture,
    Slot::Texture,
    Slot::Storage,
    Slot::Storage,
    Slot::Texture,
    Slot::Texture,
    R32_FLOAT,
];

/// Bytes of a list before the first tile.
const HEADER_BYTES: u64 = std::mem::offset_of!(gpu::TileList, tiles) as u64;

/// The steps.
#[derive(Debug)]
pub(super) struct Gather {
    test_layout: wgpu::BindGroupLayout,
    map_layout: wgpu::BindGroupLayout,
    test: wgpu::ComputePipeline,
    #[cfg(feature = "bvh")]
    geometry_layout: wgpu::BindGroupLayout,
    /// By a ray.
    #[cfg(feature = "bvh")]
    test_by_triangles: OnceLock<wgpu::ComputePipeline>,
    /// What follows the test, where a light has an extent.
    penumbra: OnceLock<Penumbra>,
    /// What does where penumbrae are left to a later pass.
    flag: OnceLock<Step>,
}

#[derive(Debug)]
struct Penumbra {
    list: Step,
    search: Step,
    blur_layout: wgpu::BindGroupLayout,
    /// Across the tilt of the receiver, and along it.
    axes: [wgpu::ComputePipeline; 2],
    disc: wgpu::ComputePipeline,
}

/// One entry point and its layout.
#[derive(Debug)]
struct Step {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Textures, the list of tiles and bind groups, for one view.
#[derive(Debug)]
pub(super) struct GatherBuffers {
    /// Whether the textures have the view's size.
    has_steps: bool,
    /// Distances to occluders.
    occlusion: wgpu::TextureView,
    /// Visibility blurred along the first axis.
    across: wgpu::TextureView,
    /// Radii of penumbrae.
    radii: wgpu::TextureView,
    /// What the test found in each tile.
    tiles: wgpu::Buffer,
    list: wgpu::Buffer,
    test_groups: BindGroupCache,
    map_groups: BindGroupCache,
    #[cfg(feature = "bvh")]
    geometry_groups: BindGroupCache,
    list_groups: BindGroupCache,
    flag_groups: BindGroupCache,
    search_groups: BindGroupCache,
    blur_groups: BindGroupCache,
    bytes: u64,
}

fn layout(device: &wgpu::Device, label: &'static str, slots: &[Slot]) -> wgpu::BindGroupLayout {
    device::layout(device, label, wgpu::ShaderStages::COMPUTE, slots)
}

fn pipeline(
    device: &wgpu::Device,
    label: &'static str,
    (source, entry_point): (&'static str, &'static str),
    layouts: &[&wgpu::BindGroupLayout],
    constants: &[(&str, f64)],
) -> wgpu::ComputePipeline {
    let spec = ComputeSpec {
        label,
        source,
        entry_point,
        layouts,
        constants,
    };
    device::compute_pipeline(device, &spec)
}

impl Penumbra {
    fn new(device: &wgpu::Device, map_layout: &wgpu::BindGroupLayout) -> Self {
        let list_layout = layout(device, "lightfall::SoftShadow::list", &LIST_SLOTS);
        let search_layout = layout(device, "lightfall::SoftShadow::search", &SEARCH_SLOTS);
        let blur_layout = layout(device, "lightfall::SoftShadow::blur", &BLUR_SLOTS);
        let blur = |label, shader, constants: &[(&str, f64)]| {
            pipeline(device, label, shader, &[&blur_layout, map_layout], constants)
        };
        let axis = |label, axis| blur(label, (wgsl::SOFT_SHADOW_BLUR, "blur_pixels"), &[("AXIS", axis)]);
        Self {
            list: Step {
                pipeline: pipeline(
                    device,
                    "lightfall::SoftShadow::list",
                    (wgsl::SOFT_SHADOW_LIST, "list_tiles"),
                    &[&list_layout],
                    &[],
                ),
                layout: list_layout,
            },
            search: Step {
                pipeline: pipeline(
                    device,
                    "lightfall::SoftShadow::search",
                    (wgsl::SOFT_SHADOW_SEARCH, "search_pixels"),
                    &[&search_layout, map_layout],
                    &[],
                ),
                layout: search_layout,
            },
            axes: [
                axis("lightfall::SoftShadow::blur_across", 0.0),
                axis("lightfall::SoftShadow::blur_along", 1.0),
            ],
            disc: blur(
                "lightfall::SoftShadow::blur_disc",
                (wgsl::SOFT_SHADOW_DISC, "gather_pixels"),
                &[],
            ),
            blur_layout,
        }
    }
}

impl Gather {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::SoftShadow::test";
        let test_layout = layout(device, label, &TEST_SLOTS);
        let map_layout = layout(device, "lightfall::SoftShadow::maps", &MAP_SLOTS);
        let shader = (wgsl::SOFT_SHADOW_TEST, "test_pixels");
        Self {
            test: pipeline(device, label, shader, &[&test_layout, &map_layout], &[]),
            test_layout,
            map_layout,
            #[cfg(feature = "bvh")]
            geometry_layout: layout(device, "lightfall::SoftShadow::geometry", &BVH_SLOTS),
            #[cfg(feature = "bvh")]
            test_by_triangles: OnceLock::new(),
            penumbra: OnceLock::new(),
            flag: OnceLock::new(),
        }
    }

    /// The test, and what follows it for a penumbra.
    pub(super) fn record(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        inputs: &SoftShadowInputs<'_>,
        light: &OneLight<'_>,
    ) {
        self.record_test(device, encoder, buffers, inputs, light);
        match (light.gathered, inputs.target) {
            (Gathered::BySteps, _) => self.record_steps(device, encoder, buffers, inputs, light),
            (Gathered::Later, ShadowTarget::Pending(pending)) => {
                let flag = self.flag.get_or_init(|| Step::flag(device));
                flag.record_flags(device, encoder, buffers, (inputs, light, pending));
            }
            _ => {}
        }
    }

    fn record_steps(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        inputs: &SoftShadowInputs<'_>,
        light: &OneLight<'_>,
    ) {
        let penumbra = self.penumbra.get_or_init(|| Penumbra::new(device, &self.map_layout));
        let maps = self.maps(device, buffers, inputs);
        penumbra.record_list(device, encoder, buffers, inputs);
        if light.settings.search == PenumbraSearch::On {
            penumbra.record_search(device, encoder, buffers, (inputs, light, &maps));
        }
        penumbra.record_blur(device, encoder, buffers, (inputs, light, &maps));
    }

    fn maps(
        &self,
        device: &wgpu::Device,
        buffers: &mut GatherBuffers,
        inputs: &SoftShadowInputs<'_>,
    ) -> wgpu::BindGroup {
        let bound = [inputs.shadow_maps.view().into()];
        let label = "lightfall::SoftShadow::maps";
        buffers.map_groups.get(device, label, &self.map_layout, &bound)
    }

    fn record_test(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        inputs: &SoftShadowInputs<'_>,
        light: &OneLight<'_>,
    ) {
        let views = inputs.g_buffer.views();
        let bound = [
            light.params.into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            (&views.base_color).into(),
            inputs.lights.buffer().into(),
            inputs.nearest.buffer().into(),
            light.layer.into(),
            (&buffers.occlusion).into(),
            (&buffers.across).into(),
            (&buffers.tiles).into(),
        ];
        let label = "lightfall::SoftShadow::test";
        let group = buffers.test_groups.get(device, label, &self.test_layout, &bound);
        let (pipeline, occluders) = self.occluders(device, buffers, inputs, light);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, &occluders, &[]);
        let [columns, rows] = tile_counts(inputs.g_buffer.size());
        pass.dispatch_workgroups(columns, rows, 1);
    }

    /// The test's pipeline, and where it looks for occluders.
    fn occluders(
        &self,
        device: &wgpu::Device,
        buffers: &mut GatherBuffers,
        inputs: &SoftShadowInputs<'_>,
        light: &OneLight<'_>,
    ) -> (&wgpu::ComputePipeline, wgpu::BindGroup) {
        #[cfg(feature = "bvh")]
        if let (OccluderTest::Triangles, Some(bvh)) = (light.settings.test, inputs.bvh) {
            let label = "lightfall::SoftShadow::test_by_triangles";
            let layouts = [&self.test_layout, &self.geometry_layout];
            let shader = (wgsl::SOFT_SHADOW_TEST_BY_TRIANGLES, "test_pixels");
            let pipeline = || pipeline(device, label, shader, &layouts, &[]);
            let groups = &mut buffers.geometry_groups;
            let group = groups.get(device, label, &self.geometry_layout, &bvh.bound());
            return (self.test_by_triangles.get_or_init(pipeline), group);
        }
        debug_assert_eq!(light.settings.test, OccluderTest::ShadowMaps);
        (&self.test, self.maps(device, buffers, inputs))
    }
}

impl Step {
    fn flag(device: &wgpu::Device) -> Self {
        let label = "lightfall::SoftShadow::flag";
        let layout = layout(device, label, &FLAG_SLOTS);
        let shader = (wgsl::SOFT_SHADOW_FLAG, "flag_tiles");
        Self {
            pipeline: pipeline(device, label, shader, &[&layout], &[]),
            layout,
        }
    }

    fn record_flags(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        (inputs, light, pending): (&SoftShadowInputs<'_>, &OneLight<'_>, &PendingPenumbrae),
    ) {
        let bound = [
            light.params.into(),
            inputs.g_buffer.view_buffer().into(),
            (&buffers.tiles).into(),
            pending.flags().into(),
        ];
        let label = "lightfall::SoftShadow::flag";
        let group = buffers.flag_groups.get(device, label, &self.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        let [columns, rows] = tile_counts(inputs.g_buffer.size());
        pass.dispatch_workgroups(columns.div_ceil(8), rows.div_ceil(8), 1);
    }
}

impl Penumbra {
    fn record_list(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        inputs: &SoftShadowInputs<'_>,
    ) {
        encoder.clear_buffer(&buffers.list, 0, Some(HEADER_BYTES));
        let bound = [
            inputs.g_buffer.view_buffer().into(),
            (&buffers.tiles).into(),
            (&buffers.list).into(),
        ];
        let label = "lightfall::SoftShadow::list";
        let group = buffers.list_groups.get(device, label, &self.list.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.list.pipeline);
        pass.set_bind_group(0, &group, &[]);
        let [columns, rows] = tile_counts(inputs.g_buffer.size());
        pass.dispatch_workgroups(columns.div_ceil(8), rows.div_ceil(8), 1);
    }

    fn record_search(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        (inputs, light, maps): (&SoftShadowInputs<'_>, &OneLight<'_>, &wgpu::BindGroup),
    ) {
        let views = inputs.g_buffer.views();
        let bound = [
            light.params.into(),
            inputs.g_buffer.view_buffer().into(),
            (&views.depth).into(),
            (&views.normal).into(),
            inputs.lights.buffer().into(),
            inputs.nearest.buffer().into(),
            (&buffers.occlusion).into(),
            (&buffers.list).into(),
            (&buffers.radii).into(),
        ];
        let label = "lightfall::SoftShadow::search";
        let group = buffers.search_groups.get(device, label, &self.search.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.search.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_bind_group(1, maps, &[]);
        pass.dispatch_workgroups_indirect(&buffers.list, 0);
    }

    fn record_blur(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut GatherBuffers,
        (inputs, light, maps): (&SoftShadowInputs<'_>, &OneLight<'_>, &wgpu::BindGroup),
    ) {
        let views = inputs.g_buffer.views();
        let label = "lightfall::SoftShadow::blur";
        let GatherBuffers {
            occlusion,
            across,
            radii,
            list,
            blur_groups,
            ..
        } = buffers;
        let mut group = |source: &wgpu::TextureView, target: &wgpu::TextureView| {
            let bound: [Bound; 9] = [
                light.params.into(),
                inputs.g_buffer.view_buffer().into(),
                (&views.depth).into(),
                (&views.normal).into(),
                inputs.lights.buffer().into(),
                (&*list).into(),
                (&*radii).into(),
                source.into(),
                target.into(),
            ];
            blur_groups.get(device, label, &self.blur_layout, &bound)
        };
        let [first, second] = &self.axes;
        let steps = match light.settings.method {
            ShadowMethod::Disc => vec![(&self.disc, group(occlusion, light.layer))],
            _ => vec![(first, group(occlusion, across)), (second, group(across, light.layer))],
        };
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        for (pipeline, group) in &steps {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.set_bind_group(1, maps, &[]);
            pass.dispatch_workgroups_indirect(list, 0);
        }
    }
}

impl GatherBuffers {
    /// For a view of `size` pixels; the steps after the test for one of `gathered`.
    pub(super) fn new(device: &wgpu::Device, size: [u32; 2], gathered: [u32; 2], lights: usize) -> Result<Self, Error> {
        use wgpu::{BufferUsages as B, TextureUsages as U};
        let specs = [
            "lightfall::SoftShadow::occlusion",
            "lightfall::SoftShadow::across",
            "lightfall::SoftShadow::radii",
        ]
        .map(|label| device::TextureSpec {
            label,
            size: gathered,
            layers: 1,
            format: wgpu::TextureFormat::R32Float,
            usage: U::TEXTURE_BINDING | U::STORAGE_BINDING,
        });
        let view = |spec| device::texture(device, spec).map(|texture| texture.create_view(&Default::default()));
        let tile_bytes = 4 * tile_counts(size).map(u64::from).iter().product::<u64>().max(1);
        let tiles = device::buffer(device, "lightfall::SoftShadow::tiles", tile_bytes, B::STORAGE)?;
        let list_usage = B::STORAGE | B::INDIRECT | B::COPY_DST;
        let list = device::buffer(
            device,
            "lightfall::SoftShadow::list",
            HEADER_BYTES + tile_bytes,
            list_usage,
        )?;
        Ok(Self {
            has_steps: gathered == size,
            occlusion: view(&specs[0])?,
            across: view(&specs[1])?,
            radii: view(&specs[2])?,
            bytes: specs.iter().map(device::TextureSpec::bytes).sum::<u64>() + tiles.size() + list.size(),
            tiles,
            list,
            test_groups: BindGroupCache::for_uses(lights),
            map_groups: BindGroupCache::default(),
            #[cfg(feature = "bvh")]
            geometry_groups: BindGroupCache::default(),
            list_groups: BindGroupCache::default(),
            flag_groups: BindGroupCache::for_uses(lights),
            search_groups: BindGroupCache::for_uses(lights),
            blur_groups: BindGroupCache::for_uses(3 * lights),
        })
    }

    pub(super) fn has_steps(&self) -> bool {
        self.has_steps
    }

    pub(super) fn memory_use(&self) -> u64 {
        self.bytes
    }
}
