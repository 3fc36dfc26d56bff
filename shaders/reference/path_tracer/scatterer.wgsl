// How what a ray meets scatters.

fn scatter_at(surface: BvhSurface, direction: vec3f) -> Scatterer {
    let m = surface.material;
    let rough_metallic = bvh_texture(bvh_materials[m].metallic_roughness_texture, surface.tex_coord).gb;
    let is_front = dot(surface.shading_normal, direction) < 0.0;
    return scatter_by(
        select(-surface.shading_normal, surface.shading_normal, is_front),
        is_front,
        bvh_base_color(surface),
        bvh_materials[m].metallic * rough_metallic.y,
        lobe_textured(bvh_materials[m].roughness, rough_metallic.x),
        bvh_materials[m].transmission,
        bvh_materials[m].index_of_refraction,
    );
}
