//! Chooses where environment maps are taken from: the first k valid of a set of candidates.
//!
//! Input: [`Geometry`], the region. Output: centres. Candidates are a Halton sequence (bases 2, 3, 5) in the region
//! (Yao et al. 2010, section 4); one is invalid inside a solid, where back faces show, or too close to a surface. Cost:
//! six coarse captures a candidate, once, and again when the geometry changes. Limits: what candidates see is not
//! compared, so two neighbours may both be taken.

use super::capture;
use crate::gpu::{self as device, BindGroupCache, ComputeSpec, Slot};
use crate::halton::radical_inverse;
use crate::resource::{CaptureView, EnvMaps, Geometry};
use crate::{Error, Timestamps, read_back, wgsl};
use glam::Vec3;

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `Params` in `shaders/pass/env_map_selector.wgsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct Params {
        pub(crate) map_size: u32,
    }

    /// Twin of `Sight`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct SightRecord {
        pub(crate) texels: u32,
        pub(crate) surfaces: u32,
        pub(crate) back_faces: u32,
        pub(crate) nearest: u32,
    }
}

/// Bindings of `shaders/pass/env_map_selector.wgsl`, in order.
pub(crate) const SLOTS: [Slot; 3] = [Slot::Uniform, Slot::UintArray, Slot::StorageMut];

/// Texels along a face of a candidate's map (Yao et al. 2010, section 4).
const CANDIDATE_SIZE: u32 = 32;

/// Candidates keep this share of the region's extent away from its border.
const MARGIN: f64 = 0.03;

/// Least extent of the candidates' box along any axis, as a share of the region's diagonal.
const THINNEST: f32 = 0.1;

/// What to try, and what to accept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvMapSelectorSettings {
    /// Candidates, up to 42. More find better places and cost six captures each, once.
    pub candidates: u32,
    /// A candidate that sees more than this share of back faces stands inside a solid.
    pub back_face_limit: f32,
    /// A candidate nearer to a surface than this share of the region's radius sees little else.
    pub clearance: f32,
}

impl Default for EnvMapSelectorSettings {
    fn default() -> Self {
        Self {
            candidates: 40,
            back_face_limit: 0.2,
            clearance: 0.03,
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
}

/// The pass.
#[derive(Debug)]
pub struct EnvMapSelector {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    inspect: wgpu::ComputePipeline,
}

/// Candidates' maps and what they see.
#[derive(Debug)]
pub struct EnvMapSelectorResources {
    env_maps: EnvMaps,
    depth: wgpu::TextureView,
    params: wgpu::Buffer,
    sights: wgpu::Buffer,
    groups: BindGroupCache,
    bytes: u64,
}

/// What a selection needs.
#[derive(Clone, Copy)]
#[allow(missing_debug_implementations, reason = "holds a trait object of the host's")]
pub struct EnvMapSelectorInputs<'a> {
    /// For the uniforms.
    pub queue: &'a wgpu::Queue,
    /// The host's draws, prepared for a list of views that holds `views`.
    pub geometry: &'a dyn Geometry,
    /// [`EnvMaps::views`] of the candidates' maps, with their indices in the list set.
    pub views: &'a [CaptureView],
    /// Sink for GPU time.
    pub timestamps: Option<&'a Timestamps>,
}

impl EnvMapSelector {
    /// The pass on this device. Needs no features and no more than default limits.
    pub fn new(device: &wgpu::Device) -> Self {
        let layout = device::layout(device, "lightfall::EnvMapSelector", wgpu::ShaderStages::COMPUTE, &SLOTS);
        let inspect = device::compute_pipeline(
            device,
            &ComputeSpec {
                label: "lightfall::EnvMapSelector::inspect",
                source: wgsl::ENV_MAP_SELECTOR,
                entry_point: "inspect_candidates",
                layouts: &[&layout],
                constants: &[],
            },
        );
        Self {
            device: device.clone(),
            layout,
            inspect,
        }
    }

    /// `count` candidate positions between two corners of the region, unit frame. A region flatter than a tenth of its
    /// diagonal is thickened to that, so that places beside its surfaces are tried.
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

    /// Records the capture of every candidate and the inspection of what it sees.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut EnvMapSelectorResources,
        inputs: &EnvMapSelectorInputs<'_>,
    ) {
        let label = "lightfall::EnvMapSelector";
        let faces = (0..).map_while(|layer| resources.env_maps.face_view(layer));
        capture::record_layers(
            encoder,
            label,
            inputs.views.iter().zip(faces),
            &resources.depth,
            inputs.geometry,
            inputs.timestamps,
        );
        let params = gpu::Params {
            map_size: CANDIDATE_SIZE,
        };
        inputs
            .queue
            .write_buffer(&resources.params, 0, bytemuck::bytes_of(&params));
        let bound = [
            (&resources.params).into(),
            resources.env_maps.view().into(),
            (&resources.sights).into(),
        ];
        let group = resources.groups.get(&self.device, label, &self.layout, &bound);
        let mut pass = device::compute_pass(encoder, label, inputs.timestamps);
        pass.set_pipeline(&self.inspect);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(resources.env_maps.centers().len() as u32, 1, 1);
    }

    /// Indices of up to `count` candidates: the valid ones in their order; if there is none, those that see the fewest
    /// back faces, so that a scene of inside-out surfaces still gets its light.
    pub fn choose(sights: &[Sight], settings: &EnvMapSelectorSettings, radius: f32, count: usize) -> Vec<usize> {
        let is_valid = |s: &Sight| {
            s.surfaces > 0.0
                && s.back_faces <= settings.back_face_limit * s.surfaces
                && s.nearest >= settings.clearance * radius
        };
        let (mut order, mut others): (Vec<usize>, Vec<usize>) = (0..sights.len()).partition(|&i| is_valid(&sights[i]));
        others.sort_by(|&a, &b| sights[a].back_faces.total_cmp(&sights[b].back_faces));
        if order.is_empty() {
            order = others;
        }
        order.truncate(count);
        order
    }
}

impl EnvMapSelectorResources {
    /// Maps for up to `candidates` candidates.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] above 42 candidates at default limits.
    pub fn new(device: &wgpu::Device, candidates: u32) -> Result<Self, Error> {
        let env_maps = EnvMaps::new(device, candidates, CANDIDATE_SIZE)?;
        let (depth, depth_bytes) = capture::depth(device, "lightfall::EnvMapSelector::depth", CANDIDATE_SIZE)?;
        let params = device::uniform_buffer::<gpu::Params>(device, "lightfall::EnvMapSelector::params")?;
        let size = u64::from(candidates.max(1)) * size_of::<gpu::SightRecord>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let sights = device::buffer(device, "lightfall::EnvMapSelector::sights", size, usage)?;
        Ok(Self {
            bytes: env_maps.memory_use() + depth_bytes + params.size() + sights.size(),
            env_maps,
            depth,
            params,
            sights,
            groups: BindGroupCache::default(),
        })
    }

    /// The candidates' maps, to set their centres and to take [`EnvMaps::views`] from.
    pub fn env_maps(&mut self) -> &mut EnvMaps {
        &mut self.env_maps
    }

    /// Waits for a submitted selection and returns what each candidate sees. Blocks; for headless use and loading screens.
    ///
    /// # Errors
    /// [`Error::ReadBack`].
    pub fn read_blocking(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<Sight>, Error> {
        let records: Vec<gpu::SightRecord> = read_back::read_buffer_blocking(device, queue, &self.sights)?;
        let count = self.env_maps.centers().len();
        Ok(records[..count].iter().map(sight).collect())
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        self.bytes
    }
}

fn sight(record: &gpu::SightRecord) -> Sight {
    let texels = record.texels.max(1) as f32;
    Sight {
        surfaces: record.surfaces as f32 / texels,
        back_faces: record.back_faces as f32 / texels,
        nearest: if record.nearest == u32::MAX {
            f32::INFINITY
        } else {
            f32::from_bits(record.nearest)
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(back_faces: f32, nearest: f32) -> Sight {
        Sight {
            surfaces: 1.0,
            back_faces,
            nearest,
        }
    }

    #[test]
    fn valid_candidates_come_first_and_in_order() {
        let sights = [
            seen(0.9, 1.0),
            seen(0.0, 1.0),
            seen(0.3, 1.0),
            seen(0.1, 1.0),
            seen(0.0, 0.001),
        ];
        let settings = EnvMapSelectorSettings::default();
        assert_eq!(EnvMapSelector::choose(&sights, &settings, 1.0, 5), [1, 3]);
        assert_eq!(EnvMapSelector::choose(&sights, &settings, 1.0, 1), [1]);
        let walled_in = [seen(0.9, 1.0), seen(0.5, 1.0), seen(0.7, 1.0)];
        assert_eq!(EnvMapSelector::choose(&walled_in, &settings, 1.0, 2), [1, 2]);
    }

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
}
