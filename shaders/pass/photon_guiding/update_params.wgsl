// The uniform of the updates.

struct UpdateParams {
    // Of what was counted before, the part that is kept
    kept: f32,
}

// Each way has so many hops beside those that were seen, of the mean weight: what few hops say is chance. From 1 to 16 the error is
// the same.
const SEEN_BY_CHANCE: f32 = 4.0;
