// Emits photons from every light, evenly or as tables say.

@group(1) @binding(0) var<storage, read> emission_tables: array<EmissionTable>;

// Evenly spread.
@compute @workgroup_size(64)
fn emit_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x < params.row && index < params.photon_count {
        emit_photon(index, random_pair(params.sample_offset + index, 0u), 1.0, 0u);
    }
}

// The first of each light's, a share of them rounded by chance, as the tables say: both parts of the sequence are as evenly
// spread as the whole.
@compute @workgroup_size(64)
fn emit_guided_photons(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.photon_count {
        return;
    }
    let light = light_of(index);
    let sequence_index = params.sample_offset + index;
    let rounded = params.guided * f32(lights[light].photon_count) + hash_unit(params.sample_offset, light);
    let is_guided = f32(index - lights[light].first_photon) < floor(rounded);
    var u = random_pair(sequence_index, 0u);
    if is_guided {
        u = emission_place(light, u);
    }
    let cell = emission_cell_at(u);
    let guiding = photon_guiding(is_guided, cell, emission_guidance(light, cell), random_guidance(sequence_index, 0u));
    emit_photon(index, u, photon_boost(guiding, params.guided), guiding);
}
