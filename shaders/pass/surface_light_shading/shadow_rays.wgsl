// Rays of a pixel, and the lights that they ask about: the same when rays are made and when their answers are counted.

// Numbers of `IndirectShadows`.
const SHADOWS_AMBIENT: u32 = 1u;
const SHADOWS_SOME: u32 = 2u;
const SHADOWS_ALL: u32 = 3u;

// A ray that asks nothing: it starts where nothing is.
const NOWHERE: vec3f = vec3f(0.0, 0.0, 64.0);

fn luminance(light: vec3f) -> f32 {
    return light.x + light.y + light.z;
}

// All of the light, if nothing were in the way.
fn unshadowed(receiver: Receiver) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < params.light_count; i++) {
        if flux[i].w > 0u {
            sum += irradiance_of(i, receiver.position, receiver.normal);
        }
    }
    return sum;
}

// Random numbers of a pixel's own.
fn pixel_random(pixel: vec2u) -> vec2f {
    let word = hash_pcg4d(vec4u(pixel, params.sample_offset, 0u));
    return vec2f(word.xy >> vec2u(8u)) * 0x1p-24;
}

// Where the scale ends that rays to some lights have their places on; rays to all have none.
fn scale_of_rays(receiver: Receiver) -> f32 {
    if params.shadows != SHADOWS_SOME {
        return 0.0;
    }
    return luminance(unshadowed(receiver));
}

// The place on the scale from 0 to all light that ray i asks about: one in each of as many equal parts.
fn ray_place(i: u32, all: f32, random: f32) -> f32 {
    return (f32(i) + random) / f32(params.ray_count) * all;
}
