// Points that are spread evenly over the unit disc (Vogel 1979), turned by another angle at each pixel.

// Of a turn: the golden angle.
const DISC_GOLDEN: f32 = 0.381966011;

// The i-th of so many; `turn` in turns.
fn disc_point(i: u32, count: u32, turn: f32) -> vec2f {
    let angle = 2.0 * SAMPLING_PI * fract(f32(i) * DISC_GOLDEN + turn);
    return sqrt((f32(i) + 0.5) / f32(count)) * vec2f(cos(angle), sin(angle));
}
