//! Which photons are traced together: groups that set out in similar directions.

use super::lights::MAX_LIGHTS;
use super::{Lights, PHOTON_BYTES, PathList, Photons};
use crate::{Error, gpu as device};

pub(crate) mod gpu {
    use bytemuck::{Pod, Zeroable};

    /// Twin of `GroupedLight` in `shaders/pass/selective_emitter/params.wgsl`.
    #[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
    #[repr(C)]
    pub(crate) struct GroupedLight {
        pub(crate) first_path: u32,
        pub(crate) path_count: u32,
        pub(crate) first_group: u32,
        pub(crate) group_count: u32,
    }
}

/// Exponents of 2 and 3 of the numbers of groups that a light may have: that many parts of nearly square shape the first two
/// dimensions of the Halton sequence are cut into by what an index leaves when divided by their number.
const PARTS: [[u32; 2]; 15] = [
    [0, 0],
    [1, 0],
    [1, 1],
    [2, 1],
    [3, 1],
    [3, 2],
    [4, 2],
    [4, 3],
    [5, 3],
    [6, 3],
    [5, 4],
    [6, 4],
    [7, 4],
    [8, 4],
    [8, 5],
];

/// The last of these numbers.
const MOST_PARTS: u32 = 62_208;

/// Paths of [`Photons`] in groups (Larsen 2004, section 9.1): of each light, those whose index leaves the same when divided by
/// 2^a 3^b start in the same part of its directions. With what is known of each group and of the paths that are traced anew.
#[derive(Debug)]
pub struct PhotonGroups {
    grouped: wgpu::Buffer,
    changed: wgpu::Buffer,
    kept: wgpu::Buffer,
    counts: wgpu::Buffer,
    probes: PathList,
    chosen: PathList,
    paths: u32,
    per_group: u32,
    kept_count: u32,
    written: Vec<gpu::GroupedLight>,
    lights: Vec<super::lights::gpu::LightRecord>,
    polygons: Vec<super::lights::gpu::Polygon>,
}

/// What has become of the lights since they were last written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LightsChange {
    /// Other numbers of photons: no path is what it was.
    Regrouped,
    /// Bits of those that are other ones.
    Moved(u64),
}

impl PhotonGroups {
    /// For all paths of `photons`, some `per_group` in each (40 in the paper), of which up to `budget` are traced anew at once:
    /// at least as many as a group has. Bytes: 4 a group, 48 a hop of each probe.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub fn new(device: &wgpu::Device, photons: &Photons, per_group: u32, budget: u32) -> Result<Self, Error> {
        use wgpu::BufferUsages as B;
        let (paths, per_group) = (photons.count(), per_group.max(1));
        let probes = most_groups(paths, per_group);
        // And one more group, the largest that there may be.
        let largest = (per_group.saturating_mul(3)).max(paths.div_ceil(MOST_PARTS));
        let chosen = budget.saturating_add(largest).clamp(1, paths.max(1));
        let hops = photons.bounces() + 1;
        let usage = B::STORAGE | B::COPY_DST | B::COPY_SRC;
        let bytes = |count: u32, each: u64| u64::from(count) * each;
        Ok(Self {
            grouped: device::buffer(device, "lightfall::PhotonGroups::lights", 16 * MAX_LIGHTS as u64, usage)?,
            changed: device::buffer(device, "lightfall::PhotonGroups::changed", bytes(probes, 4), usage)?,
            kept: device::buffer(
                device,
                "lightfall::PhotonGroups::kept",
                bytes(probes, PHOTON_BYTES * u64::from(hops)),
                usage,
            )?,
            counts: device::buffer(device, "lightfall::PhotonGroups::counts", 16, usage)?,
            probes: PathList::with_room(device, probes)?,
            chosen: PathList::with_room(device, chosen)?,
            paths,
            per_group,
            kept_count: probes,
            written: Vec::new(),
            lights: Vec::new(),
            polygons: Vec::new(),
        })
    }

    /// Says what the lights are this frame, their photons divided as [`Lights::write`] did.
    pub(crate) fn write(&mut self, queue: &wgpu::Queue, lights: &Lights) -> LightsChange {
        let mut grouped = Vec::new();
        let mut first_group = 0;
        for light in lights.records() {
            let group_count = parts_of(light.photon_count, self.per_group);
            grouped.push(gpu::GroupedLight {
                first_path: light.first_photon,
                path_count: light.photon_count,
                first_group,
                group_count,
            });
            first_group += group_count;
        }
        let before = std::mem::replace(&mut self.lights, lights.records().to_vec());
        let is_area = |l: &super::lights::gpu::LightRecord| l.kind == super::lights::gpu::AREA;
        let mut flat = 0;
        if self.polygons != lights.written_polygons() {
            self.polygons = lights.written_polygons().to_vec();
            let areas = self.lights.iter().enumerate().filter(|(_, l)| is_area(l));
            flat = areas.map(|(i, _)| 1u64 << i).sum();
        }
        if grouped == self.written {
            let pairs = before.iter().zip(&self.lights).enumerate();
            let moved = pairs.filter(|(_, (before, now))| before != now);
            let moved: u64 = moved.map(|(i, _)| 1u64 << i).sum();
            return LightsChange::Moved(moved | flat);
        }
        queue.write_buffer(&self.grouped, 0, bytemuck::cast_slice(&grouped));
        self.written = grouped;
        LightsChange::Regrouped
    }

    /// Groups of all lights.
    pub fn count(&self) -> u32 {
        self.written.last().map_or(0, |l| l.first_group + l.group_count)
    }

    /// Paths of the largest group: as many times each group is probed until all of its paths were.
    pub fn largest(&self) -> u32 {
        let sizes = self.written.iter().map(|l| l.path_count.div_ceil(l.group_count.max(1)));
        sizes.max().unwrap_or(0)
    }

    /// Lights that have groups.
    pub(crate) fn light_count(&self) -> u32 {
        self.written.len() as u32
    }

    /// Paths in all groups.
    pub fn paths(&self) -> u32 {
        self.paths
    }

    /// A path of each group.
    pub fn probes(&self) -> &PathList {
        &self.probes
    }

    /// All paths of the groups that are traced anew.
    pub fn chosen(&self) -> &PathList {
        &self.chosen
    }

    /// What the probes were before they were traced anew: slot hop × [`PhotonGroups::kept_count`] + place in the list, 48 bytes
    /// each.
    pub fn kept(&self) -> &wgpu::Buffer {
        &self.kept
    }

    /// Slots of a hop in [`PhotonGroups::kept`].
    pub fn kept_count(&self) -> u32 {
        self.kept_count
    }

    /// Four `u32` of the last frame: paths probed, those that had become other ones, paths chosen to be traced anew, groups
    /// that wait.
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }

    /// Of each group, a `u32`: how much its probes have found changed since it was traced, 0: nothing.
    pub fn changed(&self) -> &wgpu::Buffer {
        &self.changed
    }

    pub(crate) fn grouped(&self) -> &wgpu::Buffer {
        &self.grouped
    }

    /// Bytes allocated.
    pub fn memory_use(&self) -> u64 {
        let own = [&self.grouped, &self.changed, &self.kept, &self.counts].map(wgpu::Buffer::size);
        own.iter().sum::<u64>() + self.probes.memory_use() + self.chosen.memory_use()
    }
}

/// Groups of so many paths: those of which a group comes nearest to `per_group`, in ratio, and one at least.
fn parts_of(paths: u32, per_group: u32) -> u32 {
    let wanted = f64::from(paths) / f64::from(per_group);
    let off = |parts: u32| (f64::from(parts) / wanted.max(1.0)).ln().abs();
    let numbers = PARTS.map(|[a, b]| 2u32.pow(a) * 3u32.pow(b));
    let most = paths.min(2 * paths.div_ceil(per_group));
    let fitting = numbers.into_iter().filter(|&n| n <= most);
    fitting.min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0)
}

/// As many groups as there may be, however paths are divided among lights.
fn most_groups(paths: u32, per_group: u32) -> u32 {
    // Each light's are at most twice those of its share, rounded up.
    paths.min(2 * paths.div_ceil(per_group) + 2 * MAX_LIGHTS as u32).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::halton::radical_inverse;

    #[test]
    fn groups_are_about_as_large_as_wanted_and_never_more_than_there_is_room_for() {
        for per_group in [1, 7, 40, 1000] {
            for paths in (0..2000).chain((2000..1_300_000).step_by(997)) {
                let groups = parts_of(paths, per_group);
                assert!(groups <= paths && groups <= most_groups(paths, per_group));
                if per_group == 40 && paths >= 100 {
                    let size = f64::from(paths) / f64::from(groups);
                    assert!((20.0..85.0).contains(&size), "{paths}: {size}");
                }
            }
            for lights in [2, 3, 5, 64] {
                for each in [1, 40, 1000, 100_000, 101_000] {
                    let groups = lights * parts_of(each, per_group);
                    assert!(groups <= most_groups(lights * each, per_group), "{lights} of {each}");
                }
            }
        }
        assert_eq!(parts_of(3080, 40), 72);
    }

    #[test]
    fn a_group_sets_out_in_one_part_of_its_lights_directions() {
        for [a, b] in PARTS {
            let parts = 2u32.pow(a) * 3u32.pow(b);
            for group in 0..parts {
                let cell = |i: u32| {
                    let index = 1000 * parts + group + i * parts;
                    let at = |base: u32, exponent: u32| {
                        (radical_inverse(index, base) * f64::from(base.pow(exponent))).floor() as u32
                    };
                    [at(2, a), at(3, b)]
                };
                assert!((1..5).all(|i| cell(i) == cell(0)), "{parts}: {group}");
            }
        }
    }
}
