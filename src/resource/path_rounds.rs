//! All paths in rounds, which take turns.

use super::path_list::{self, PathList};
use crate::{Error, gpu as device};

/// Paths in a row that are of one round: a run of the Halton sequence is spread as evenly as all of it, while every n-th of it
/// sets out in one part of the directions where n has a factor of 2 or 3. After 4 of 8 rounds caustics of a ball are off what
/// lies halfway by 1.5 % of the change; with every eighth path in a round, by 27 %.
const RUN: u32 = 64;

/// A list of paths for each of some rounds, which have every path once.
#[derive(Debug)]
pub(crate) struct PathRounds {
    /// Of the round that was recorded last.
    list: PathList,
    /// Of all rounds, one behind the other.
    lists: wgpu::Buffer,
    count: u32,
}

impl PathRounds {
    /// Of so many paths, in so many rounds or, of few paths, fewer. Bytes: 4 a path, and as much again for those of a round.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`].
    pub(crate) fn new((gpu, queue): (&wgpu::Device, &wgpu::Queue), paths: u32, rounds: u32) -> Result<Self, Error> {
        let count = rounds.clamp(1, paths.div_ceil(RUN).max(1));
        let all: Vec<Vec<u32>> = (0..count)
            .map(|round| paths_of(round, count, paths).collect())
            .collect();
        // The first rounds have the most.
        let list = PathList::with_room(gpu, all[0].len() as u32)?;
        let words = list.buffer().size() as usize / 4;
        let mut records = Vec::with_capacity(words * all.len());
        for own in &all {
            let header = path_list::header(own.len() as u32);
            records.extend(header.iter().chain(own));
            records.resize(records.len().next_multiple_of(words), 0);
        }
        let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let bytes = 4 * records.len() as u64;
        let lists = device::buffer(gpu, "lightfall::PathRounds", bytes, usage)?;
        queue.write_buffer(&lists, 0, bytemuck::cast_slice(&records));
        Ok(Self { list, lists, count })
    }

    /// Rounds until all paths had their turn.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Records which paths are those of a round.
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder, round: u32) -> &PathList {
        let bytes = self.list.buffer().size();
        let from = u64::from(round % self.count) * bytes;
        encoder.copy_buffer_to_buffer(&self.lists, from, self.list.buffer(), 0, bytes);
        &self.list
    }

    /// Bytes allocated.
    pub(crate) fn memory_use(&self) -> u64 {
        self.list.memory_use() + self.lists.size()
    }
}

/// Every so-manieth run.
fn paths_of(round: u32, rounds: u32, paths: u32) -> impl Iterator<Item = u32> {
    let runs = (round..paths.div_ceil(RUN)).step_by(rounds as usize);
    runs.flat_map(move |run| run * RUN..paths.min(run * RUN + RUN))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_has_its_turn_once_and_rounds_are_about_as_large() {
        for (paths, rounds) in [(0, 1), (1, 1), (63, 1), (1000, 8), (1000, 16), (100_000, 7)] {
            let all: Vec<Vec<u32>> = (0..rounds).map(|r| paths_of(r, rounds, paths).collect()).collect();
            let sizes = all.iter().map(Vec::len);
            assert!(sizes.clone().max().unwrap() - sizes.clone().min().unwrap() <= RUN as usize);
            assert_eq!(sizes.max().unwrap(), all[0].len());
            let mut joined = all.concat();
            joined.sort_unstable();
            assert!(joined.into_iter().eq(0..paths), "{paths} in {rounds}");
        }
    }
}
