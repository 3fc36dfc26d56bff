// The uniform of both ways to make lights of photons.

struct Params {
    path_count: u32,
    // Whose light goes on
    hop_count: u32,
    // Of the pool's paths, the one that the first new path replaces
    first_path: u32,
    // Paths in the pool
    pool_count: u32,
    // Invocations in a row of the dispatch
    row: u32,
    // Share of the pool that the new paths are: what the flux of each is multiplied by
    share: f32,
    // 1: what comes and goes is noted, of one hop more as well
    keeps_changes: u32,
}
