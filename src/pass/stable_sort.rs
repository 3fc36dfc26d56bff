//! A stable sort of keys with values, such as photons by the bins that they lie in.

use crate::Error;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::wgsl;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `SortParams` in `shaders/pass/stable_sort.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SortParams {
        pub(crate) count: u32,
        pub(crate) blocks: u32,
        pub(crate) shift: u32,
        pub(crate) row: u32,
    }
}

/// Bindings of `shaders/pass/stable_sort.wgsl`, in order.
pub(crate) const SORT_SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
];

/// Keys that a workgroup takes. Twin of `ROUNDS` × `LANES`.
const BLOCK: u32 = 1024;

/// Bits of the key that one pass sorts by, and their values.
const DIGIT_BITS: u32 = 7;
const DIGITS: u32 = 1 << DIGIT_BITS;

/// Its pipelines.
#[derive(Debug)]
pub(crate) struct StableSort {
    layout: wgpu::BindGroupLayout,
    count: wgpu::ComputePipeline,
    sum: wgpu::ComputePipeline,
    place: wgpu::ComputePipeline,
}

/// Keys, values, and what is counted of them.
#[derive(Debug)]
pub(crate) struct SortBuffers {
    /// Each pass reads one side and writes the other.
    sides: [Side; 2],
    counts: wgpu::Buffer,
    totals: wgpu::Buffer,
    /// One for each pass.
    params: Vec<wgpu::Buffer>,
    groups: BindGroupCache,
}

#[derive(Debug)]
pub(crate) struct Side {
    pub(crate) keys: wgpu::Buffer,
    pub(crate) values: wgpu::Buffer,
}

impl StableSort {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let layout = device::layout(
            device,
            "lightfall::StableSort",
            wgpu::ShaderStages::COMPUTE,
            &SORT_SLOTS,
        );
        let pipeline = |label, entry_point| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source: wgsl::STABLE_SORT,
                    entry_point,
                    layouts: &[&layout],
                    constants: &[],
                },
            )
        };
        Self {
            count: pipeline("lightfall::StableSort count", "count_digits"),
            sum: pipeline("lightfall::StableSort sum", "sum_digits"),
            place: pipeline("lightfall::StableSort place", "place_keys"),
            layout,
        }
    }

    /// Sorts the first `count` keys of the side to sort, into the sorted side.
    pub(crate) fn record(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        pass: &mut wgpu::ComputePass<'_>,
        buffers: &mut SortBuffers,
        count: u32,
    ) {
        let blocks = count.div_ceil(BLOCK);
        let [x, y] = device::dispatch_size(blocks);
        for (index, buffer) in (0..).zip(&buffers.params) {
            let params = gpu::SortParams {
                count,
                blocks,
                shift: DIGIT_BITS * index,
                row: x,
            };
            queue.write_buffer(buffer, 0, bytemuck::bytes_of(&params));
            let (from, to) = (
                &buffers.sides[index as usize % 2],
                &buffers.sides[(index as usize + 1) % 2],
            );
            let bound = [
                buffer.into(),
                (&from.keys).into(),
                (&from.values).into(),
                (&to.keys).into(),
                (&to.values).into(),
                (&buffers.counts).into(),
                (&buffers.totals).into(),
            ];
            let label = "lightfall::StableSort";
            let group = buffers.groups.get(device, label, &self.layout, &bound);
            pass.set_bind_group(0, &group, &[]);
            let steps = [(&self.count, [x, y]), (&self.sum, [1, 1]), (&self.place, [x, y])];
            for (pipeline, [x, y]) in steps {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(x, y, 1);
            }
        }
    }
}

impl SortBuffers {
    /// Bytes to sort so many keys.
    pub(crate) fn size_in_bytes(count: u32, largest_key: u32) -> u64 {
        let [keys, counts] = Self::sizes(count);
        4 * keys + counts + 4 * u64::from(DIGITS) + u64::from(passes(largest_key)) * size_of::<gpu::SortParams>() as u64
    }

    /// Of the keys, and of what is counted of them by digit and block.
    pub(crate) fn sizes(count: u32) -> [u64; 2] {
        [
            4 * u64::from(count.max(1)),
            4 * u64::from(DIGITS) * u64::from(count.div_ceil(BLOCK).max(1)),
        ]
    }

    pub(crate) fn new(device: &wgpu::Device, count: u32, largest_key: u32) -> Result<Self, Error> {
        let [keys, counts] = Self::sizes(count);
        let buffer = |label, bytes| device::buffer(device, label, bytes, wgpu::BufferUsages::STORAGE);
        let side = || {
            Ok::<_, Error>(Side {
                keys: buffer("lightfall::StableSort::keys", keys)?,
                values: buffer("lightfall::StableSort::values", keys)?,
            })
        };
        let params = |_| device::uniform_buffer::<gpu::SortParams>(device, "lightfall::StableSort_params");
        let passes = passes(largest_key);
        Ok(Self {
            sides: [side()?, side()?],
            counts: buffer("lightfall::StableSort::digit_counts", counts)?,
            totals: buffer("lightfall::StableSort::digit_totals", 4 * u64::from(DIGITS))?,
            params: (0..passes).map(params).collect::<Result<_, _>>()?,
            groups: BindGroupCache::for_uses(passes as usize),
        })
    }

    /// Where keys and values are written before the sort.
    pub(crate) fn unsorted(&self) -> &Side {
        &self.sides[0]
    }

    /// Where they are after it.
    pub(crate) fn sorted(&self) -> &Side {
        &self.sides[self.params.len() % 2]
    }
}

/// Passes that keys up to this one need.
fn passes(largest_key: u32) -> u32 {
    (u32::BITS - largest_key.leading_zeros()).div_ceil(DIGIT_BITS).max(1)
}
