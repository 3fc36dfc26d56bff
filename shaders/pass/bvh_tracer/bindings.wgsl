// What rays through the trees read: group 1 of every shader that traces them.

@group(1) @binding(0) var<storage, read> bvh_nodes: array<vec4u>;
@group(1) @binding(1) var<storage, read> bvh_corners: array<vec4f>;
@group(1) @binding(2) var<storage, read> bvh_attributes: array<BvhAttributes>;
@group(1) @binding(3) var<storage, read> bvh_instances: array<BvhInstance>;
@group(1) @binding(4) var<storage, read> bvh_materials: array<BvhMaterial>;
@group(1) @binding(5) var bvh_srgb_textures: texture_2d_array<f32>;
@group(1) @binding(6) var bvh_linear_textures: texture_2d_array<f32>;
@group(1) @binding(7) var bvh_sampler: sampler;
