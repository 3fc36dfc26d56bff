// Irradiance at more pixels from samples at a part of them, and which pixels leave it in doubt.

// `MarkedPixels` while it is filled.
struct Marking {
    workgroups: array<u32, 3>,
    count: atomic<u32>,
    pixels: array<u32>,
}

@group(0) @binding(0) var<uniform> interpolation: Interpolation;
@group(0) @binding(1) var<uniform> view: View;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var base_color_texture: texture_2d<f32>;
@group(0) @binding(5) var surface_texture: texture_2d<u32>;
@group(0) @binding(6) var coarse: texture_2d<f32>;
@group(0) @binding(7) var irradiance: texture_storage_2d<rgba32float, write>;
@group(0) @binding(8) var<storage, read_write> marked: Marking;

// Of a workgroup's pixels: a bit for each that is marked, and where they go in the list.
var<workgroup> marks: array<atomic<u32>, 2>;
var<workgroup> first_mark: u32;

@compute @workgroup_size(8, 8)
fn upsample_pixels(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    var is_marked = false;
    if all(id.xy < min(subsampling_size(view.size, interpolation.target_factor), textureDimensions(irradiance))) {
        let estimate = estimate_at(id.xy);
        textureStore(irradiance, id.xy, vec4f(estimate.irradiance, estimate.fits));
        is_marked = estimate.is_marked && interpolation.is_marking == 1u;
    }
    if is_marked {
        atomicOr(&marks[lane / 32u], 1u << (lane % 32u));
    }
    workgroupBarrier();
    let words = vec2u(atomicLoad(&marks[0]), atomicLoad(&marks[1]));
    let counts = countOneBits(words);
    if lane == 0u && counts.x + counts.y > 0u {
        first_mark = atomicAdd(&marked.count, counts.x + counts.y);
    }
    workgroupBarrier();
    if is_marked {
        let before = countOneBits(words[lane / 32u] & ((1u << (lane % 32u)) - 1u));
        let rank = select(0u, counts.x, lane >= 32u) + before;
        marked.pixels[first_mark + rank] = id.x | id.y << 16u;
    }
}

// What an indirect dispatch needs.
@compute @workgroup_size(1)
fn count_marks() {
    marked.workgroups = path_list_workgroups(atomicLoad(&marked.count));
}
