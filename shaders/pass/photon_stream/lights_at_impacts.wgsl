// A light at each impact (instant radiosity, Keller 1997), the baseline of lights that stay where they are.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<uniform> grid: SurfaceLightGrid;
@group(0) @binding(2) var<storage, read> photons: array<Photon>;
@group(0) @binding(3) var<storage, read_write> lights: array<SurfaceLight>;
@group(0) @binding(4) var<storage, read_write> flux: array<vec4u>;

@compute @workgroup_size(64)
fn lights_at_impacts(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if index >= params.path_count * params.hop_count {
        return;
    }
    let photon = photons[index];
    let sent_on = flux_steps(exitant_flux(photon), index);
    lights[index] = SurfaceLight(photon.position, 0.0, octahedral_unpack(photon.normal), 0u);
    flux[index] = vec4u(sent_on, 1u);
}
