// Samples of the surfaces that light reaches: of each run of photon slots the first photon that was stored.

@group(0) @binding(0) var<storage, read> photons: array<Photon>;
@group(0) @binding(1) var<storage, read_write> samples: array<SurfaceSample>;

@compute @workgroup_size(64)
fn pick_samples(@builtin(global_invocation_id) id: vec3u) {
    let count = arrayLength(&samples);
    if id.x >= count {
        return;
    }
    let slots = arrayLength(&photons);
    // All slots are in a run: the first so many runs are longer by one.
    let longer = slots % count;
    let first = id.x * (slots / count) + min(id.x, longer);
    let end = first + slots / count + u32(id.x < longer);
    var found = SurfaceSample(vec3f(2.0 * SURFACE_SAMPLE_NOWHERE), 0u);
    for (var slot = first; slot < end; slot++) {
        if (photons[slot].state & PHOTON_STATE_MASK) == PHOTON_STORED {
            found = SurfaceSample(photons[slot].position, photons[slot].normal);
            break;
        }
    }
    samples[id.x] = found;
}
