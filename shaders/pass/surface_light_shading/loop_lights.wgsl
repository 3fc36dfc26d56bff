// All lights at every pixel.

@group(0) @binding(8) var irradiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn loop_lights(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= subsampling_size(view.size, params.factor)) {
        return;
    }
    let receiver = receiver_of(id.xy);
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.light_count && receiver.is_seen; i++) {
        if flux[i].w > 0u {
            sum += irradiance_of(i, receiver.position, receiver.normal);
        }
    }
    textureStore(irradiance, id.xy, vec4f(sum, f32(receiver.is_seen)));
}
