// Where indirect light comes from, over the cells of the square that directions as dense as the cosine are made of.

const INCIDENT_SIDE: u32 = 8u;
const INCIDENT_CELLS: u32 = 64u;
// Of a texel's cells, and behind them how many photons.
const INCIDENT_STRIDE: u32 = 65u;

// The cell of a direction in the frame of a surface, z the cosine.
fn incident_cell(direction: vec3f) -> u32 {
    let u = sampling_cosine_inverse(direction);
    let at = min(vec2u(max(u, vec2f(0.0)) * f32(INCIDENT_SIDE)), vec2u(INCIDENT_SIDE - 1u));
    return at.y * INCIDENT_SIDE + at.x;
}
