//! Times of frames and stages.

use super::adapter::Gpu;
use super::offline::Offline;
use lightfall::{Error, Timestamps, wgpu};

/// Renders frames and keeps their times: of GPU timestamps where the device has them, else on the wall. A stage that runs
/// in some frames only counts for its share. Of a software adapter frames are timed on the wall all the same: it writes
/// timestamps when it comes to a pass, not when the work before is done.
pub(crate) struct Clock {
    timestamps: Option<Timestamps>,
    is_software: bool,
    /// Steady-state frames only: the first one also compiles and allocates.
    frames_ms: Vec<f64>,
    stages: Vec<(&'static str, Vec<f64>)>,
    seen_first: bool,
}

impl Clock {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            timestamps: Timestamps::new(&gpu.device).ok(),
            is_software: gpu.info.device_type == wgpu::DeviceType::Cpu,
            frames_ms: Vec::new(),
            stages: Vec::new(),
            seen_first: false,
        }
    }

    /// What the times of frames are taken with: "gpu" or "wall".
    pub(crate) fn kind(&self) -> &'static str {
        if self.is_on_gpu() { "gpu" } else { "wall" }
    }

    fn is_on_gpu(&self) -> bool {
        self.timestamps.is_some() && !self.is_software
    }

    /// Renders the next frame.
    pub(crate) fn frame(&mut self, gpu: &Gpu, offline: &mut Offline<'_>) -> Result<(), String> {
        self.time(gpu, |timestamps| offline.render_frame(timestamps))
    }

    /// Renders something and waits for it.
    pub(crate) fn time(
        &mut self,
        gpu: &Gpu,
        render: impl FnOnce(Option<&Timestamps>) -> Result<(), Error>,
    ) -> Result<(), String> {
        let start = std::time::Instant::now();
        render(self.timestamps.as_ref()).map_err(|e| e.to_string())?;
        let wall_ms = start.elapsed().as_secs_f64() * 1e3;
        let stages = match &self.timestamps {
            Some(t) => t.take_blocking(&gpu.device, &gpu.queue).map_err(|e| e.to_string())?,
            None => Vec::new(),
        };
        if !self.seen_first {
            self.seen_first = true;
            return Ok(());
        }
        self.frames_ms.push(if self.is_on_gpu() {
            stages.iter().map(|s| s.1).sum()
        } else {
            wall_ms
        });
        for (label, ms) in stages {
            match self.stages.iter_mut().find(|(l, _)| *l == label) {
                Some((_, all)) => all.push(ms),
                None => self.stages.push((label, vec![ms])),
            }
        }
        Ok(())
    }

    /// Renders further frames until there are enough for a median: at least a whole round of the selection of places for
    /// environment maps.
    pub(crate) fn settle(&mut self, gpu: &Gpu, offline: &mut Offline<'_>) -> Result<(), String> {
        let enough = offline.renderer.settings().selector.interval.max(3) as usize;
        while self.frames_ms.len() < enough {
            self.frame(gpu, offline)?;
        }
        Ok(())
    }

    /// Milliseconds of the last frame, but for the very first.
    pub(crate) fn last_ms(&self) -> Option<f64> {
        self.frames_ms.last().copied()
    }

    /// Forgets all times: frames are others from now on.
    pub(crate) fn restart(&mut self) {
        self.frames_ms.clear();
        self.stages.clear();
        self.seen_first = false;
    }

    /// Median, shortest and longest frame in the steady state, milliseconds.
    pub(crate) fn frame_ms(&self) -> [f64; 3] {
        let extreme = |f: fn(f64, f64) -> f64| self.frames_ms.iter().copied().reduce(f).unwrap_or(0.0);
        [median(&self.frames_ms), extreme(f64::min), extreme(f64::max)]
    }

    /// Milliseconds of each stage in a frame, in order of first use.
    pub(crate) fn stages_ms(&self) -> impl Iterator<Item = (&'static str, f64)> {
        self.stages.iter().map(|(name, all)| {
            let share = all.len() as f64 / self.frames_ms.len().max(1) as f64;
            (*name, median(all) * share)
        })
    }
}

pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
