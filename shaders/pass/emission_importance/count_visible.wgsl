// Counts, for each emission cell of each light, the paths that started there and the hops of theirs that arrived where the
// eye sees.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> photons: array<Photon>;
@group(0) @binding(2) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(3) var<uniform> view: View;
@group(0) @binding(4) var depth_texture: texture_2d<f32>;

// A photon is seen if it lies no further from what its pixel shows than this share of the distance to the eye.
const TOLERANCE: f32 = 0.02;

fn is_seen(p: vec3f) -> bool {
    let clip = view.view_projection * vec4f(p, 1.0);
    let ndc = clip.xyz / clip.w;
    if clip.w <= 0.0 || any(abs(ndc.xy) >= vec2f(1.0)) {
        return false;
    }
    let pixel = vec2u((vec2f(0.5, -0.5) * ndc.xy + 0.5) * vec2f(view.size));
    let at = min(pixel, view.size - 1u);
    let depth = textureLoad(depth_texture, view.origin + at, 0).x;
    let surface = g_buffer_position(view, vec2f(at), depth);
    return distance(surface, p) <= TOLERANCE * abs(clip.w);
}

@compute @workgroup_size(64)
fn count_visible(@builtin(global_invocation_id) id: vec3u) {
    let slot = id.y * params.row + id.x;
    if id.x >= params.row || slot >= params.slot_count {
        return;
    }
    let photon = photons[slot];
    let light = photon_light(photon.light_and_surface);
    if light >= params.light_count {
        return;
    }
    let cell = 2u * (light * EMISSION_CELL_TOTAL + photon_cell(photon.state));
    if slot < params.path_count {
        if (photon.state & PHOTON_STATE_MASK) != PHOTON_EMPTY {
            atomicAdd(&counts[cell], 1u);
        }
    } else if photon_is_splatted(photon.state) && is_seen(photon.position) {
        atomicAdd(&counts[cell + 1u], 1u);
    }
}
