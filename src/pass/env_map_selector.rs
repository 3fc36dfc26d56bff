//! Chooses where environment maps are taken from: the few of many candidates that together see the most.
//!
//! Inputs: [`Geometry`], candidates, and photons of an earlier frame if there are any. Output: a [`Selection`], a frame or
//! two later. Each candidate is captured at 32² texels a face into one atlas. What it sees is counted in one of two ways: in
//! samples of the surfaces where photons arrived and of what is seen from there, or by area (Yao et al. 2010, Eq. 1), texel by
//! texel. Greedily the candidate that sees the most new is added, until there are enough maps or the coverage target is
//! reached; then maps are exchanged while that helps (section 4.1), and those that are not needed are dropped. Nothing leaves
//! the GPU but the result, and nothing waits for it.
//!
//! Cost: six coarse captures a candidate; by samples, a look-up for each sample and candidate, then (maps + swaps) ×
//! candidates × samples / 32 words; by area, (maps + swaps) × candidates × 6144 texels. While a scene changes, a fifth of the
//! candidates a frame and one exchange every fifth frame keep the selection up to date. Limits: at 32² a texel is 3° wide, so
//! thin things are missed; areas are off by some percent (`docs/accuracy.md`); 31 maps fit the bit masks.

use crate::gpu::{self as device, BindGroupCache, ComputeSpec, RenderSpec, Slot};
use crate::halton::radical_inverse;
use crate::read_back::{self, ReadBackRing};
use crate::resource::{
    CaptureMask, CapturePurpose, CaptureTargets, CaptureView, EnvMaps, Geometry, Photons, PrepareContext,
    SURFACE_FORMAT,
};
use crate::scene::UnitFrame;
use crate::{Error, Timestamps, wgsl};
use glam::Vec3;
use std::ops::Range;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/env_map_selector/params.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) candidate_count: u32,
        pub(crate) columns: u32,
        pub(crate) limit: u32,
        pub(crate) tag: u32,
        pub(crate) back_face_limit: f32,
        pub(crate) clearance: f32,
        pub(crate) tolerance: f32,
        pub(crate) coverage_target: f32,
        pub(crate) sample_count: u32,
        pub(crate) least_gain: f32,
        pub(crate) slot_count: u32,
    }

    /// Twin of `SurfaceSample` in `shaders/common/surface_sample.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SurfaceSample {
        pub(crate) position: [f32; 3],
        pub(crate) normal: u32,
    }

    /// Twin of `Sight`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SightRecord {
        pub(crate) surfaces: u32,
        pub(crate) back_faces: u32,
        pub(crate) nearest: u32,
        pub(crate) is_valid: u32,
        pub(crate) area: f32,
        pub(crate) unseen: f32,
        pub(crate) own: f32,
        pub(crate) exchange: f32,
    }

    /// Twin of `Selection`.
    #[derive(Debug, Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SelectionRecord {
        pub(crate) tag: u32,
        pub(crate) selected: u32,
        pub(crate) newest: u32,
        pub(crate) is_done: u32,
        pub(crate) is_stable: u32,
        pub(crate) swaps: u32,
        pub(crate) coverage: f32,
        pub(crate) total: f32,
        pub(crate) chosen: [u32; 32],
    }
}

/// Bindings of group 0 of `shaders/pass/env_map_selector/select_maps.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 7] = [
    Slot::Uniform,
    Slot::UintTexture,
    Slot::Storage,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::StorageMut,
    Slot::Storage,
];

/// Bindings of its group 1.
pub(crate) const SWITCH_SLOTS: [Slot; 1] = [Slot::StorageMut];

/// Bindings of `shaders/pass/env_map_selector/pick_samples.wgsl`, in order.
pub(crate) const SAMPLE_SLOTS: [Slot; 6] = [
    Slot::Uniform,
    Slot::UintTexture,
    Slot::Storage,
    Slot::Storage,
    Slot::Storage,
    Slot::StorageMut,
];

/// Samples of surfaces, the first half where light arrives: four times as many found no better places (`docs/tracing.md`).
const SAMPLES: u32 = 8192;

/// Texels along a face of a candidate's map (Yao et al. 2010, section 4). Twin of `CANDIDATE_SIZE`.
pub(crate) const CANDIDATE_SIZE: u32 = 32;

const CANDIDATE_TEXELS: u64 = 6 * (CANDIDATE_SIZE as u64) * (CANDIDATE_SIZE as u64);

/// Most maps that can be selected: one bit of 32 each, and one for the map that a swap tries.
pub const MAX_SELECTED: u32 = 31;

/// Swaps tried after the greedy steps; two to five suffice (Yao et al. 2010, section 4.1).
const MOST_SWAPS: u32 = 8;

/// A surface this share of the region's radius behind a texel's plane is hidden by it. Coarse texels are flat pieces of what
/// may be curved; a larger share would look through thin walls.
const TOLERANCE: f32 = 0.004;

/// The same for samples: a photon's place is itself off by as much as a shadow map's texel.
const SAMPLE_TOLERANCE: f32 = 0.008;

/// Candidates keep this share of the region's extent away from its border.
const MARGIN: f64 = 0.03;

/// Least extent of the candidates' box along any axis, as a share of the region's diagonal.
const THINNEST: f32 = 0.1;

/// What the sight of a candidate is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CoverageMeasure {
    /// Places where photons of an earlier frame arrived, and, for a sixteenth, what is seen from where these are seen: what
    /// light reaches, or might. Until there are any, area.
    #[default]
    Photons,
    /// Area (Yao et al. 2010, Eq. 1): all that can be seen from any candidate, the outside of a building too.
    Area,
}

/// What to try, what to accept, and when enough is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvMapSelectorSettings {
    /// Candidates, up to 512. More find better places and cost six coarse captures each, and 150 kB: four times as many leave a
    /// hundredth less of the rays to a surer tracer, as much as four more maps do in a living room (`docs/tracing.md`).
    pub candidates: u32,
    /// A candidate that sees more than this share of back faces stands inside a solid.
    pub back_face_limit: f32,
    /// A candidate nearer to a surface than this share of the region's radius sees little else.
    pub clearance: f32,
    /// What is to be covered. [`EnvMapSelector`] itself goes by the photons that it is given, or not given.
    pub measure: CoverageMeasure,
    /// Share of what all candidates see at which no further map is added. Higher selects more maps, which cost
    /// captures and find more of what rays hit. Below 1 a map must be worth 0.012 % of all of it, and 0.2 % while things
    /// move, a sample seen a second time counting a five-hundredth; 1: as many as there may be.
    pub coverage_target: f32,
    /// Frames over which all candidates are captured anew while the scene changes; each such round ends with one
    /// maintenance step. More frames are cheaper each and follow changes later.
    pub interval: u32,
}

impl Default for EnvMapSelectorSettings {
    /// A target of 0.999 left a corner of a Cornell box unseen that holds a thousandth of the photons, and doubled the
    /// relative squared error of a small image of it.
    fn default() -> Self {
        Self {
            candidates: 100,
            back_face_limit: 0.2,
            clearance: 0.03,
            measure: CoverageMeasure::default(),
            coverage_target: 0.9999,
            interval: 5,
        }
    }
}

/// What one candidate sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Share of directions in which there is a surface.
    pub surfaces: f32,
    /// Share of directions in which the back of one is seen.
    pub back_faces: f32,
    /// Distance of the nearest surface, unit frame; infinite if there is none.
    pub nearest: f32,
    /// Whether it may be selected.
    pub is_valid: bool,
    /// A(v | ∅): area of the surfaces seen, unit-frame lengths squared; or the number of samples seen, those around for a
    /// sixteenth.
    pub area: f32,
    /// A(v | C): the part that no selected map sees.
    pub unseen: f32,
}

/// Where environment maps should be taken from.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// Indices of the selected candidates.
    pub candidates: Vec<usize>,
    /// Their positions, unit frame; none if no photon arrived anywhere.
    pub centers: Vec<Vec3>,
    /// Share, by area or in samples, of what valid candidates see that selected ones see.
    pub coverage: f32,
    /// Whether the last swap tried would have changed nothing.
    pub is_stable: bool,
    /// Swaps that changed the selection since it was started.
    pub swaps: u32,
    /// [`EnvMapSelectorInputs::tag`] of the step it came from.
    pub tag: u32,
}

/// Share of all there is to be seen that a map, or the exchange of one, has to gain; and while geometry moves, where every
/// exchange is seen as a jump of what maps do not see well.
const LEAST_GAIN: f32 = 1.2e-4;
const LEAST_GAIN_IN_MOTION: f32 = 2e-3;

/// What to do with the candidates once they are captured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SelectionStep {
    /// Nothing yet.
    Capture,
    /// Select anew: greedily, then exchanges until stable, then without the maps that are not needed.
    Select,
    /// One maintenance step of the present selection while geometry moves: drops maps whose places became invalid, adds
    /// where more is to be seen, and tries one swap. Valid maps that seem to be needed no more are kept: to drop them and
    /// take them back flickers.
    Maintain,
    /// A step for geometry that has come to rest: up to eight exchanges, by samples, and up to eight maps less that are not
    /// needed any more.
    Settle,
}

/// The pass.
#[derive(Debug)]
pub struct EnvMapSelector {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    switch_layout: wgpu::BindGroupLayout,
    sample_layout: wgpu::BindGroupLayout,
    clear: wgpu::RenderPipeline,
    steps: Steps,
}

/// One pipeline for each entry point.
#[derive(Debug)]
struct Steps {
    start_anew: wgpu::ComputePipeline,
    inspect_candidates: wgpu::ComputePipeline,
    admit_candidates: wgpu::ComputePipeline,
    mark_all: wgpu::ComputePipeline,
    mark_newest: wgpu::ComputePipeline,
    sum_unseen: wgpu::ComputePipeline,
    add_map: wgpu::ComputePipeline,
    begin_swaps: wgpu::ComputePipeline,
    add_for_swap: wgpu::ComputePipeline,
    drop_map: wgpu::ComputePipeline,
    end_steps: wgpu::ComputePipeline,
    try_without: wgpu::ComputePipeline,
    keep_if_needed: wgpu::ComputePipeline,
    measure_coverage: wgpu::ComputePipeline,
    switch_maps: wgpu::ComputePipeline,
    pick_samples: wgpu::ComputePipeline,
    see_samples: wgpu::ComputePipeline,
    try_exchanges: wgpu::ComputePipeline,
    exchange_map: wgpu::ComputePipeline,
}

/// Candidates, their maps, and the selection so far.
#[derive(Debug)]
pub struct EnvMapSelectorResources {
    atlas: wgpu::TextureView,
    depth: wgpu::TextureView,
    columns: u32,
    candidates: Vec<Vec3>,
    capacity: u32,
    centers: wgpu::Buffer,
    params: wgpu::Buffer,
    sights: wgpu::Buffer,
    seen_by: wgpu::Buffer,
    selection: wgpu::Buffer,
    samples: wgpu::Buffer,
    results: ReadBackRing,
    /// Results of steps before this one belong to other candidates.
    valid_from: u32,
    last_tag: u32,
    groups: BindGroupCache,
    bytes: u64,
}

/// What a frame gives it.
#[derive(Clone)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct EnvMapSelectorInputs<'a> {
    /// For the uniforms.
    pub queue: &'a wgpu::Queue,
    /// The host's draws, prepared for a list of views that holds `views`.
    pub geometry: &'a dyn Geometry,
    /// Candidates to capture now.
    pub candidates: Range<usize>,
    /// [`EnvMapSelectorResources::views`] of those, with their indices in the list set.
    pub views: &'a [CaptureView],
    /// What to do after capturing.
    pub step: SelectionStep,
    /// Most maps to select, up to [`MAX_SELECTED`].
    pub limit: u32,
    /// Radius of the region, unit frame.
    pub radius: f32,
    /// A number to know the result by. Numbers grow from step to step.
    pub tag: u32,
    /// Maps that stand at the first candidates because no result has arrived yet: those at invalid ones are switched off.
    pub provisional: Option<&'a EnvMaps>,
    /// Photons of an earlier frame, in the same unit frame: what counts is how many of the places where they arrived are
    /// seen. `None`: the area that is seen.
    pub photons: Option<&'a Photons>,
    /// What to accept, and when enough is seen.
    pub settings: &'a EnvMapSelectorSettings,
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl EnvMapSelector {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let label = "lightfall::EnvMapSelector";
        let layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SLOTS);
        let switch_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SWITCH_SLOTS);
        let sample_layout = device::layout(device, label, wgpu::ShaderStages::COMPUTE, &SAMPLE_SLOTS);
        let step = |label, source, entry_point, layouts: &[&wgpu::BindGroupLayout]| {
            device::compute_pipeline(
                device,
                &ComputeSpec {
                    label,
                    source,
                    entry_point,
                    layouts,
                    constants: &[],
                },
            )
        };
        macro_rules! step {
            ($entry_point:literal, $($layout:expr),+) => {
                step!(wgsl::ENV_MAP_SELECTOR, $entry_point, $($layout),+)
            };
            ($source:expr, $entry_point:literal, $($layout:expr),+) => {
                step(concat!("lightfall::EnvMapSelector::", $entry_point), $source, $entry_point, &[$($layout),+])
            };
        }
        let steps = Steps {
            start_anew: step!("start_anew", &layout),
            inspect_candidates: step!("inspect_candidates", &layout),
            admit_candidates: step!("admit_candidates", &layout),
            mark_all: step!("mark_all", &layout),
            mark_newest: step!("mark_newest", &layout),
            sum_unseen: step!("sum_unseen", &layout),
            add_map: step!("add_map", &layout),
            begin_swaps: step!("begin_swaps", &layout),
            add_for_swap: step!("add_for_swap", &layout),
            drop_map: step!("drop_map", &layout),
            end_steps: step!("end_steps", &layout),
            try_without: step!("try_without", &layout),
            keep_if_needed: step!("keep_if_needed", &layout),
            measure_coverage: step!("measure_coverage", &layout),
            switch_maps: step!("switch_maps", &layout, &switch_layout),
            pick_samples: step!(wgsl::ENV_MAP_SELECTOR_SAMPLES, "pick_samples", &sample_layout),
            see_samples: step!("see_samples", &layout),
            try_exchanges: step!("try_exchanges", &layout),
            exchange_map: step!("exchange_map", &layout),
        };
        Self {
            device: device.clone(),
            clear: clear_pipeline(device),
            layout,
            switch_layout,
            sample_layout,
            steps,
        }
    }

    /// `count` candidate positions between two corners of the region, unit frame: a Halton sequence of bases 2, 3 and 5
    /// (Yao et al. 2010, section 4). A region flatter than a tenth of its diagonal is thickened to that, so that places
    /// beside its surfaces are tried.
    pub fn candidates(min: Vec3, max: Vec3, count: u32) -> Vec<Vec3> {
        let thinnest = THINNEST * (max - min).length();
        let middle = 0.5 * (min + max);
        let half = (0.5 * (max - min)).max(Vec3::splat(0.5 * thinnest));
        let (min, max) = (middle - half, middle + half);
        let at = |i: u32, axis: usize, base: u32| {
            let share = MARGIN + (1.0 - 2.0 * MARGIN) * radical_inverse(i + 1, base);
            (f64::from(min[axis]) + share * f64::from(max[axis] - min[axis])) as f32
        };
        (0..count)
            .map(|i| Vec3::new(at(i, 0, 2), at(i, 1, 3), at(i, 2, 5)))
            .collect()
    }

    /// Records the capture of some candidates and a step of the selection. The result of a step arrives with
    /// [`EnvMapSelectorResources::take_selection`].
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EnvMapSelectorResources,
        inputs: &EnvMapSelectorInputs<'_>,
    ) {
        encoder.push_debug_group("lightfall::EnvMapSelector");
        self.record_capture(encoder, resources, inputs);
        if inputs.step != SelectionStep::Capture && !resources.candidates.is_empty() {
            self.record_steps(encoder, resources, inputs);
            resources.last_tag = inputs.tag;
            resources.results.record(encoder, &resources.selection);
        }
        encoder.pop_debug_group();
    }

    fn record_capture(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &EnvMapSelectorResources,
        inputs: &EnvMapSelectorInputs<'_>,
    ) {
        if inputs.views.is_empty() {
            return;
        }
        let label = "lightfall::EnvMapSelector::capture";
        let is_whole = inputs.candidates.len() >= resources.candidates.len();
        let begin = if is_whole {
            device::render_pass
        } else {
            device::render_pass_over
        };
        let mut pass = begin(
            encoder,
            label,
            &[&resources.atlas],
            Some(&resources.depth),
            inputs.timestamps,
        );
        let first = 6 * inputs.candidates.start as u32;
        for (tile, view) in (first..6 * resources.capacity).zip(inputs.views) {
            let [x, y] = [tile % resources.columns, tile / resources.columns].map(|i| i * CANDIDATE_SIZE);
            let size = CANDIDATE_SIZE as f32;
            pass.set_viewport(x as f32, y as f32, size, size, 0.0, 1.0);
            pass.set_scissor_rect(x, y, CANDIDATE_SIZE, CANDIDATE_SIZE);
            if !is_whole {
                pass.set_pipeline(&self.clear);
                pass.draw(0..3, 0..1);
            }
            inputs.geometry.draw(&mut pass, view);
        }
    }

    fn record_steps(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EnvMapSelectorResources,
        inputs: &EnvMapSelectorInputs<'_>,
    ) {
        let count = resources.candidates.len() as u32;
        let limit = inputs.limit.clamp(1, MAX_SELECTED);
        let params = gpu::Params {
            candidate_count: count,
            columns: resources.columns,
            limit,
            tag: inputs.tag,
            back_face_limit: inputs.settings.back_face_limit,
            clearance: inputs.settings.clearance * inputs.radius,
            tolerance: inputs.radius
                * match inputs.photons {
                    Some(_) => SAMPLE_TOLERANCE,
                    None => TOLERANCE,
                },
            coverage_target: inputs.settings.coverage_target,
            sample_count: inputs.photons.map_or(0, |_| SAMPLES),
            slot_count: inputs.photons.map_or(0, Photons::slots),
            least_gain: match inputs.step {
                SelectionStep::Maintain => LEAST_GAIN_IN_MOTION,
                _ => LEAST_GAIN,
            },
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            (&resources.atlas).into(),
            (&resources.centers).into(),
            (&resources.sights).into(),
            (&resources.seen_by).into(),
            (&resources.selection).into(),
            (&resources.samples).into(),
        ];
        let label = "lightfall::EnvMapSelector::select";
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let switch_group = inputs.provisional.map(|maps| {
            let bound = [maps.centers_buffer().into()];
            resources.groups.get(&self.device, label, &self.switch_layout, &bound)
        });
        let sample_group = inputs.photons.map(|photons| {
            let bound = [
                (&resources.params).into(),
                (&resources.atlas).into(),
                (&resources.centers).into(),
                (&resources.sights).into(),
                photons.buffer().into(),
                (&resources.samples).into(),
            ];
            resources.groups.get(&self.device, label, &self.sample_layout, &bound)
        });
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_bind_group(0, &group, &[]);
        let steps = &self.steps;
        let is_anew = inputs.step == SelectionStep::Select;
        if is_anew {
            run(&mut pass, &steps.start_anew, 1);
        }
        run(&mut pass, &steps.inspect_candidates, count);
        run(&mut pass, &steps.admit_candidates, 1);
        let by_samples = sample_group.is_some();
        if let Some(sample_group) = &sample_group {
            pass.set_bind_group(0, sample_group, &[]);
            run(&mut pass, &steps.pick_samples, SAMPLES);
            pass.set_bind_group(0, &group, &[]);
            run(&mut pass, &steps.see_samples, count);
        } else if !is_anew {
            run(&mut pass, &steps.mark_all, count);
        }
        let mut run = |pipeline: &wgpu::ComputePipeline, groups: u32| run(&mut pass, pipeline, groups);
        // In a maintenance these fill places that became invalid, and add maps where the scene has grown.
        for _ in 0..limit {
            run(&steps.sum_unseen, count);
            run(&steps.add_map, 1);
            if !by_samples {
                run(&steps.mark_newest, count);
            }
        }
        run(&steps.end_steps, 1);
        run(&steps.sum_unseen, count);
        run(&steps.begin_swaps, 1);
        let most_swaps = match inputs.step {
            SelectionStep::Capture | SelectionStep::Maintain => 1,
            SelectionStep::Select => MOST_SWAPS,
            // By area it costs as much as the greedy step of a map.
            SelectionStep::Settle => {
                if by_samples {
                    MOST_SWAPS
                } else {
                    1
                }
            }
        };
        for _ in 0..most_swaps {
            if by_samples {
                run(&steps.try_exchanges, count);
                run(&steps.exchange_map, 1);
            } else {
                run(&steps.add_for_swap, 1);
                run(&steps.mark_newest, count);
                run(&steps.sum_unseen, count);
                run(&steps.drop_map, 1);
            }
            run(&steps.sum_unseen, count);
        }
        run(&steps.end_steps, 1);
        run(&steps.sum_unseen, count);
        let most_dropped = match inputs.step {
            SelectionStep::Capture | SelectionStep::Maintain => 0,
            SelectionStep::Select | SelectionStep::Settle => MOST_SWAPS,
        };
        for _ in 0..most_dropped {
            run(&steps.try_without, 1);
            run(&steps.sum_unseen, count);
            run(&steps.keep_if_needed, 1);
            run(&steps.sum_unseen, count);
        }
        run(&steps.end_steps, 1);
        run(&steps.sum_unseen, count);
        run(&steps.measure_coverage, 1);
        if let Some(group) = &switch_group {
            pass.set_bind_group(1, group, &[]);
            pass.set_pipeline(&steps.switch_maps);
            pass.dispatch_workgroups(count.div_ceil(64), 1, 1);
        }
    }

    /// Captures all candidates, selects, and waits for the result: for headless use and loading screens. It prepares the
    /// geometry for views of its own and submits.
    ///
    /// # Errors
    /// [`Error::ReadBack`], or what the geometry's `prepare` returns.
    pub fn select_blocking(
        &self,
        resources: &mut EnvMapSelectorResources,
        inputs: &SelectBlockingInputs<'_>,
        geometry: &mut dyn Geometry,
    ) -> Result<Selection, Error> {
        let mut views: Vec<CaptureView> = resources.views(0..resources.candidates.len()).collect();
        for (index, view) in (0..).zip(&mut views) {
            view.index = index;
        }
        let context = PrepareContext {
            device: &self.device,
            queue: inputs.queue,
            frame: inputs.frame,
        };
        geometry.prepare(&context, &views)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let all = EnvMapSelectorInputs {
            queue: inputs.queue,
            geometry,
            candidates: 0..resources.candidates.len(),
            views: &views,
            step: SelectionStep::Select,
            limit: inputs.limit,
            radius: inputs.frame.radius(),
            tag: inputs.tag,
            provisional: None,
            photons: inputs.photons,
            settings: inputs.settings,
            timestamps: None,
        };
        self.record(&mut encoder, resources, &all);
        inputs.queue.submit([encoder.finish()]);
        let records: Vec<gpu::SelectionRecord> =
            read_back::read_buffer_blocking(&self.device, inputs.queue, &resources.selection)?;
        Ok(resources.selection_of(&records[0]))
    }
}

/// What [`EnvMapSelector::select_blocking`] needs.
#[derive(Debug, Clone, Copy)]
pub struct SelectBlockingInputs<'a> {
    /// To submit to.
    pub queue: &'a wgpu::Queue,
    /// The frame that candidates are in.
    pub frame: &'a UnitFrame,
    /// Most maps to select, up to [`MAX_SELECTED`].
    pub limit: u32,
    /// A number to know the result by.
    pub tag: u32,
    /// As in [`EnvMapSelectorInputs::photons`].
    pub photons: Option<&'a Photons>,
    /// What to accept, and when enough is seen.
    pub settings: &'a EnvMapSelectorSettings,
}

impl EnvMapSelectorResources {
    /// Most candidates.
    pub const MAX_CANDIDATES: u32 = 512;

    /// Bytes for `candidates` candidates.
    pub fn size_in_bytes(candidates: u32) -> u64 {
        let size = atlas_size(candidates);
        let texels = device::texture_bytes(size, 1, SURFACE_FORMAT)
            + device::texture_bytes(size, 1, CaptureTargets::of(CapturePurpose::Candidate).depth);
        let each = 16 + size_of::<gpu::SightRecord>() as u64 + 4 * CANDIDATE_TEXELS;
        let selection = size_of::<gpu::SelectionRecord>() as u64;
        let results = selection + ReadBackRing::size_in_bytes(selection);
        let samples = u64::from(SAMPLES) * size_of::<gpu::SurfaceSample>() as u64;
        texels + u64::from(candidates.max(1)) * each + samples + results + size_of::<gpu::Params>() as u64
    }

    /// Room for up to `candidates` candidates.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] above [`EnvMapSelectorResources::MAX_CANDIDATES`], or if the device grants less.
    pub fn new(device: &wgpu::Device, candidates: u32) -> Result<Self, Error> {
        if candidates > Self::MAX_CANDIDATES {
            return Err(Error::LimitExceeded {
                what: "EnvMapSelector candidates".into(),
                needed: u64::from(candidates),
                limit: u64::from(Self::MAX_CANDIDATES),
                remedy: "use fewer candidates",
            });
        }
        let size = atlas_size(candidates);
        let texture = |label, format, usage| {
            let spec = device::TextureSpec {
                label,
                size,
                layers: 1,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
            };
            Ok(device::texture(device, &spec)?.create_view(&Default::default()))
        };
        use wgpu::BufferUsages as U;
        let count = u64::from(candidates.max(1));
        let storage = |label, bytes, usage| device::buffer(device, label, bytes, U::STORAGE | usage);
        let selection_bytes = size_of::<gpu::SelectionRecord>() as u64;
        Ok(Self {
            atlas: texture(
                "lightfall::EnvMapSelector::atlas",
                SURFACE_FORMAT,
                wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
            )?,
            depth: texture(
                "lightfall::EnvMapSelector::depth",
                CaptureTargets::of(CapturePurpose::Candidate).depth,
                wgpu::TextureUsages::empty(),
            )?,
            columns: size[0] / CANDIDATE_SIZE,
            candidates: Vec::new(),
            capacity: candidates,
            centers: storage("lightfall::EnvMapSelector::centers", 16 * count, U::COPY_DST)?,
            params: device::uniform_buffer::<gpu::Params>(device, "lightfall::EnvMapSelector::params")?,
            sights: storage(
                "lightfall::EnvMapSelector::sights",
                count * size_of::<gpu::SightRecord>() as u64,
                U::COPY_SRC,
            )?,
            seen_by: storage(
                "lightfall::EnvMapSelector::seen_by",
                4 * CANDIDATE_TEXELS * count,
                U::empty(),
            )?,
            selection: storage("lightfall::EnvMapSelector::selection", selection_bytes, U::COPY_SRC)?,
            samples: storage(
                "lightfall::EnvMapSelector::samples",
                u64::from(SAMPLES) * size_of::<gpu::SurfaceSample>() as u64,
                U::empty(),
            )?,
            results: ReadBackRing::new(device, "lightfall::EnvMapSelector::results", selection_bytes)?,
            valid_from: 0,
            last_tag: 0,
            groups: BindGroupCache::default(),
            bytes: Self::size_in_bytes(candidates),
        })
    }

    /// Says where the candidates are, unit frame. Results of steps recorded before do not arrive any more.
    ///
    /// # Errors
    /// [`Error::CountMismatch`] if there are more than it was made for.
    pub fn set_candidates(&mut self, queue: &wgpu::Queue, candidates: &[Vec3]) -> Result<(), Error> {
        if candidates.len() > self.capacity as usize {
            return Err(Error::CountMismatch {
                what: "candidates for environment maps (room made)",
                expected: self.capacity as usize,
                found: candidates.len(),
            });
        }
        let padded: Vec<[f32; 4]> = candidates.iter().map(|c| c.extend(1.0).to_array()).collect();
        queue.write_buffer(&self.centers, 0, bytemuck::cast_slice(&padded));
        self.candidates = candidates.to_vec();
        self.valid_from = self.last_tag + 1;
        Ok(())
    }

    /// Positions of the candidates, unit frame.
    pub fn candidates(&self) -> &[Vec3] {
        &self.candidates
    }

    /// The candidates' maps, texels as in [`EnvMaps`]: tiles of 32², row by row; tile 6 c + f is face f of candidate c.
    pub fn atlas(&self) -> &wgpu::TextureView {
        &self.atlas
    }

    /// The views that capture some of the candidates, six each; none for those that do not exist.
    pub fn views(&self, candidates: Range<usize>) -> impl Iterator<Item = CaptureView> + '_ {
        let (purpose, mask) = (CapturePurpose::Candidate, CaptureMask::InEnvMaps);
        let wanted = self.candidates.iter().take(candidates.end).skip(candidates.start);
        wanted.flat_map(move |&center| {
            (0..6).map(move |face| CaptureView::cube_face(purpose, mask, center, face, CANDIDATE_SIZE))
        })
    }

    /// The latest selection that has arrived since the last call. Does not wait: a result arrives when the host submits
    /// or polls after the GPU has finished the frame that recorded it.
    pub fn take_selection(&mut self) -> Option<Selection> {
        let record: gpu::SelectionRecord = self.results.take()?;
        (record.tag >= self.valid_from).then(|| self.selection_of(&record))
    }

    /// Whether the result of a step will never arrive, because what recorded it was not submitted.
    pub fn take_lost(&mut self) -> bool {
        self.results.take_lost()
    }

    /// Waits for a submitted step and returns what each candidate sees. Blocks; for headless use.
    ///
    /// # Errors
    /// [`Error::ReadBack`].
    pub fn sights_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<Sight>, Error> {
        let records: Vec<gpu::SightRecord> = read_back::read_buffer_blocking(device, queue, &self.sights)?;
        Ok(records[..self.candidates.len()].iter().map(sight).collect())
    }

    fn selection_of(&self, record: &gpu::SelectionRecord) -> Selection {
        let candidates: Vec<usize> = (0..32)
            .filter(|bit| record.selected >> bit & 1 == 1)
            .map(|bit| record.chosen[bit] as usize)
            .filter(|&candidate| candidate < self.candidates.len())
            .collect();
        Selection {
            centers: candidates.iter().map(|&c| self.candidates[c]).collect(),
            candidates,
            coverage: record.coverage,
            is_stable: record.is_stable != 0,
            swaps: record.swaps,
            tag: record.tag,
        }
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

fn run(pass: &mut wgpu::ComputePass<'_>, pipeline: &wgpu::ComputePipeline, groups: u32) {
    pass.set_pipeline(pipeline);
    pass.dispatch_workgroups(groups, 1, 1);
}

/// Columns and rows of tiles, nearly a square, in texels.
fn atlas_size(candidates: u32) -> [u32; 2] {
    let tiles = 6 * candidates.max(1);
    let columns = f64::from(tiles).sqrt().ceil() as u32;
    [columns * CANDIDATE_SIZE, tiles.div_ceil(columns) * CANDIDATE_SIZE]
}

/// Draws nothing, infinitely far away, over whatever is there.
fn clear_pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let targets = CaptureTargets::of(CapturePurpose::Candidate);
    device::render_pipeline(
        device,
        &RenderSpec {
            label: "lightfall::EnvMapSelector::clear",
            source: wgsl::ENV_MAP_SELECTOR_CLEAR,
            fragment: "fragment",
            layouts: &[],
            constants: &[],
            buffers: &[],
            topology: wgpu::PrimitiveTopology::TriangleList,
            cull_mode: None,
            targets: &[Some(SURFACE_FORMAT.into())],
            depth_stencil: Some(wgpu::DepthStencilState {
                depth_compare: Some(wgpu::CompareFunction::Always),
                ..targets.depth_stencil()
            }),
        },
    )
}

fn sight(record: &gpu::SightRecord) -> Sight {
    let texels = CANDIDATE_TEXELS as f32;
    Sight {
        surfaces: record.surfaces as f32 / texels,
        back_faces: record.back_faces as f32 / texels,
        nearest: if record.nearest == u32::MAX {
            f32::INFINITY
        } else {
            f32::from_bits(record.nearest)
        },
        is_valid: record.is_valid != 0,
        area: record.area,
        unseen: record.unseen,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_region_is_tried_on_both_sides() {
        let all = EnvMapSelector::candidates(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.0, 0.5), 40);
        assert!(all.iter().any(|c| c.y > 0.02) && all.iter().any(|c| c.y < -0.02));
    }

    #[test]
    fn candidates_lie_inside_and_apart() {
        let all = EnvMapSelector::candidates(Vec3::splat(-0.5), Vec3::new(0.5, 0.25, 0.5), 40);
        for (i, a) in all.iter().enumerate() {
            assert!(a.cmpgt(Vec3::splat(-0.5)).all() && a.cmplt(Vec3::new(0.5, 0.25, 0.5)).all());
            assert!(all[..i].iter().all(|b| (a - b).length() > 0.02));
        }
    }

    #[test]
    fn an_atlas_holds_all_tiles_and_little_more() {
        for candidates in [0, 1, 2, 40, 200, EnvMapSelectorResources::MAX_CANDIDATES] {
            let [width, height] = atlas_size(candidates).map(|s| s / CANDIDATE_SIZE);
            let tiles = 6 * candidates.max(1);
            assert!(
                width * height >= tiles && width * height < tiles + width,
                "{candidates}"
            );
            assert!(width.max(height) * CANDIDATE_SIZE <= wgpu::Limits::default().max_texture_dimension_2d);
        }
    }
}
