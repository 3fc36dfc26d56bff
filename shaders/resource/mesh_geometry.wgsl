// Draws meshes for every kind of view. Positions reach the fragment stage in the unit frame.

struct View {
    view_projection: mat4x4f,
    eye: vec4f,
}

struct Instance {
    transform: mat4x4f,
    normal_transform: mat3x3f,
    material: u32,
    mirrored: u32,
    surface: u32,
}

struct Material {
    base_color: vec3f,
    alpha_cutoff: f32,
    emission: vec3f,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    index_of_refraction: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> materials: array<Material>;
@group(1) @binding(0) var base_color_texture: texture_2d<f32>;
@group(1) @binding(1) var emission_texture: texture_2d<f32>;
@group(1) @binding(2) var metallic_roughness_texture: texture_2d<f32>;
@group(1) @binding(3) var material_sampler: sampler;

struct Vertex {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tex_coord: vec2f,
    @location(3) @interpolate(flat) instance: u32,
}

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tex_coord: vec2f,
    @builtin(instance_index) index: u32,
) -> Vertex {
    let instance = instances[index];
    let unit = instance.transform * vec4f(position, 1.0);
    return Vertex(view.view_projection * unit, unit.xyz, instance.normal_transform * normal, tex_coord, index);
}

struct Surface {
    geometric_normal: vec3f,
    base_color: vec4f,
    emission: vec3f,
    alpha_cutoff: f32,
    front_facing: bool,
    lobe: u32,
}

// Everything that needs derivatives, before any discard.
fn surface_at(v: Vertex, front_facing: bool) -> Surface {
    let instance = instances[v.instance];
    let material = materials[instance.material];
    let texel = textureSample(base_color_texture, material_sampler, v.tex_coord);
    let emission = textureSample(emission_texture, material_sampler, v.tex_coord).rgb * material.emission;
    let rough_metallic = textureSample(metallic_roughness_texture, material_sampler, v.tex_coord).gb;
    let lobe = lobe_of(
        material.metallic * rough_metallic.y,
        lobe_textured(material.roughness, rough_metallic.x),
        material.transmission,
        material.index_of_refraction,
    );
    let front = front_facing != (instance.mirrored == 1u);
    return Surface(
        surface_capture_normal(v.position),
        vec4f(material.base_color, 1.0) * texel,
        emission,
        material.alpha_cutoff,
        front,
        lobe,
    );
}

// What a surface texel says of the side that is seen: what reflects and refracts is as smooth as it is shaded, wherever the ray
// comes from that side.
fn texel_normal(v: Vertex, surface: Surface) -> vec3f {
    let ray = select(view.eye.xyz, v.position - view.eye.xyz, view.eye.w > 0.0);
    let is_same_side = (dot(v.normal, ray) < 0.0) == surface.front_facing;
    let is_shaded = lobe_is_specular(surface.lobe) && is_same_side && dot(v.normal, v.normal) > 0.0;
    return select(surface.geometric_normal, normalize(v.normal), is_shaded);
}

@fragment
fn fragment_surface(v: Vertex, @builtin(front_facing) front_facing: bool) -> @location(0) vec4u {
    let surface = surface_at(v, front_facing);
    if surface.base_color.a < surface.alpha_cutoff {
        discard;
    }
    let normal = texel_normal(v, surface);
    let texel = surface_texel_at(v.position, normal, surface.base_color.rgb, view.eye, surface.front_facing);
    let scattering = surface_texel_scattering(texel, surface.lobe);
    return surface_texel_pack(surface_texel_on(scattering, instances[v.instance].surface));
}

struct GBufferTexel {
    @location(0) normal: vec2f,
    @location(1) base_color: vec4f,
    @location(2) emission: vec4f,
    @location(3) surface: u32,
}

@fragment
fn fragment_g_buffer(v: Vertex, @builtin(front_facing) front_facing: bool) -> GBufferTexel {
    let surface = surface_at(v, front_facing);
    if surface.base_color.a < surface.alpha_cutoff {
        discard;
    }
    let towards_viewer = select(-view.eye.xyz, view.eye.xyz - v.position, view.eye.w > 0.0);
    let g = surface.geometric_normal;
    let geometric = select(-g, g, dot(g, towards_viewer) > 0.0);
    // Vertex normals point out of the front; where there are none the triangle is flat.
    let has_normal = dot(v.normal, v.normal) > 0.0;
    let front = normalize(select(geometric, v.normal, has_normal));
    let shading = select(front, -front, has_normal && !surface.front_facing);
    let emission = select(vec3f(0.0), surface.emission, surface.front_facing);
    // Of what is not diffuse also whether its back is seen.
    let back = select(HIT_BACK, 0u, surface.front_facing || !lobe_is_specular(surface.lobe));
    let scattering = surface.lobe | back;
    return GBufferTexel(
        octahedral_encode(shading),
        vec4f(surface.base_color.rgb, 1.0),
        vec4f(emission, 1.0),
        instances[v.instance].surface | (scattering << 16u),
    );
}
