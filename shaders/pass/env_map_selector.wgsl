// What each candidate sees, in four numbers: one workgroup a candidate.

struct Params {
    map_size: u32,
}

struct Sight {
    texels: u32,
    surfaces: u32,
    back_faces: u32,
    // f32 bits of the nearest distance; all ones if there is none
    nearest: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var env_maps: texture_2d_array<u32>;
@group(0) @binding(2) var<storage, read_write> sights: array<Sight>;

var<workgroup> surfaces: atomic<u32>;
var<workgroup> back_faces: atomic<u32>;
var<workgroup> nearest: atomic<u32>;

@compute @workgroup_size(256)
fn inspect_candidates(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    if lane == 0u {
        atomicStore(&surfaces, 0u);
        atomicStore(&back_faces, 0u);
        atomicStore(&nearest, 0xffffffffu);
    }
    workgroupBarrier();
    let size = params.map_size;
    let texels = 6u * size * size;
    for (var i = lane; i < texels; i += 256u) {
        let face = i / (size * size);
        let at = vec2u(i % size, (i / size) % size);
        let bits = env_map_load(group.x, face, at);
        if bits.x != 0u {
            atomicAdd(&surfaces, 1u);
            atomicMin(&nearest, bits.x);
        }
        if (bits.w & SURFACE_TEXEL_BACK_FACE) != 0u {
            atomicAdd(&back_faces, 1u);
        }
    }
    workgroupBarrier();
    if lane == 0u {
        sights[group.x] = Sight(texels, atomicLoad(&surfaces), atomicLoad(&back_faces), atomicLoad(&nearest));
    }
}
