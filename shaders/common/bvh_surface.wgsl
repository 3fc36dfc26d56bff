// What a ray finds where it hits: place, normals, material. Reads bvh_corners, bvh_attributes, bvh_instances,
// bvh_materials, bvh_srgb_textures, bvh_linear_textures and bvh_sampler, which the pass declares.

// Twins of `resource::texture_arrays` and `resource::bvh_mesh`.
const BVH_NO_TEXTURE: u32 = 0xffffffffu;
const BVH_LINEAR_TEXTURE: u32 = 0x80000000u;
const BVH_NO_NORMAL: u32 = 0x80008000u;
const BVH_ODD: u32 = 0x80000000u;

struct BvhAttributes {
    // Of the corners as they are stored
    tex_coords: array<vec2f, 3>,
    // Number in the mesh
    triangle: u32,
    // Two bits for the place in the mesh's triangle of each stored corner; BVH_ODD where that order turns it over
    order: u32,
}

struct BvhMaterial {
    base_color: vec3f,
    alpha_cutoff: f32,
    emission: vec3f,
    index_of_refraction: f32,
    metallic: f32,
    roughness: f32,
    transmission: f32,
    base_color_texture: u32,
    metallic_roughness_texture: u32,
    emission_texture: u32,
}

struct BvhSurface {
    // Unit frame
    position: vec3f,
    // Distance of neighbouring numbers of the size that the position was computed from
    ulp: f32,
    // Unit normal of the triangle, out of its front
    geometric_normal: vec3f,
    // Interpolated unit normal, on the same side; the geometric one where the mesh has none
    shading_normal: vec3f,
    tex_coord: vec2f,
    material: u32,
}

fn bvh_texture(texture: u32, tex_coord: vec2f) -> vec4f {
    if texture == BVH_NO_TEXTURE {
        return vec4f(1.0);
    }
    let layer = texture & ~BVH_LINEAR_TEXTURE;
    if (texture & BVH_LINEAR_TEXTURE) != 0u {
        return textureSampleLevel(bvh_linear_textures, bvh_sampler, tex_coord, layer, 0.0);
    }
    return textureSampleLevel(bvh_srgb_textures, bvh_sampler, tex_coord, layer, 0.0);
}

fn bvh_tex_coord(triangle: u32, barycentric: vec2f) -> vec2f {
    let a = bvh_attributes[triangle].tex_coords[0];
    let b = bvh_attributes[triangle].tex_coords[1];
    let c = bvh_attributes[triangle].tex_coords[2];
    return a + barycentric.x * (b - a) + barycentric.y * (c - a);
}

// Whether a material is cut out where a triangle was hit.
fn bvh_is_hole(instance: u32, triangle: u32, barycentric: vec2f) -> bool {
    if (bvh_instances[instance].mask & BVH_HAS_HOLES) == 0u {
        return false;
    }
    let material = bvh_instances[instance].material;
    let texel = bvh_texture(bvh_materials[material].base_color_texture, bvh_tex_coord(triangle, barycentric));
    return texel.a < bvh_materials[material].alpha_cutoff;
}

fn bvh_corner_normal(corner: u32) -> vec3f {
    let bits = bitcast<u32>(bvh_corners[corner].w);
    return select(octahedral_unpack(bits), vec3f(0.0), bits == BVH_NO_NORMAL);
}

// The unit vector that is normal to two edges of a triangle. A triangle without area, which a ray may still meet in its
// one line, has some normal too.
fn bvh_across(ab: vec3f, ac: vec3f) -> vec3f {
    // Squares of small edges would be too small for f32.
    let sizes = max(abs(ab), abs(ac));
    let scale = 1.0 / max(1e-30, max(sizes.x, max(sizes.y, sizes.z)));
    let across = cross(ab * scale, ac * scale);
    let area = length(across);
    return select(vec3f(0.0, 0.0, 1.0), across / area, area > 0.0);
}

fn bvh_surface(hit: BvhHit) -> BvhSurface {
    let first = 3u * hit.triangle;
    let a = bvh_corners[first].xyz;
    let ab = bvh_corners[first + 1u].xyz - a;
    let ac = bvh_corners[first + 2u].xyz - a;
    let weights = hit.barycentric;
    let to_unit = bvh_instances[hit.instance].to_unit;
    let center = bvh_instances[hit.instance].center;
    let position = center + to_unit * (a + weights.x * ab + weights.y * ac);
    // A mesh may be far larger than the region that the unit frame was made for.
    let size = abs(center) + abs(to_unit[0] * a.x) + abs(to_unit[1] * a.y) + abs(to_unit[2] * a.z);
    // Normals transform by the inverse transpose.
    let for_normals = transpose(bvh_instances[hit.instance].to_mesh);
    let is_odd = (bvh_attributes[hit.triangle].order & BVH_ODD) != 0u;
    let geometric = normalize(for_normals * bvh_across(select(ab, ac, is_odd), select(ac, ab, is_odd)));
    let interpolated = (1.0 - weights.x - weights.y) * bvh_corner_normal(first)
        + weights.x * bvh_corner_normal(first + 1u) + weights.y * bvh_corner_normal(first + 2u);
    let has_shading = dot(interpolated, interpolated) > 0.0;
    let shading = select(geometric, normalize(for_normals * interpolated), has_shading);
    return BvhSurface(
        position,
        bvh_ulp(size),
        geometric,
        select(-shading, shading, dot(shading, geometric) >= 0.0),
        bvh_tex_coord(hit.triangle, weights),
        bvh_instances[hit.instance].material,
    );
}

// Where a ray may start that leaves the surface on the side of a normal.
fn bvh_leave(surface: BvhSurface, normal: vec3f) -> vec3f {
    return surface.position + (BVH_OFFSET_ULPS * surface.ulp) * normal;
}

fn bvh_base_color(surface: BvhSurface) -> vec3f {
    let material = surface.material;
    let texel = bvh_texture(bvh_materials[material].base_color_texture, surface.tex_coord);
    return bvh_materials[material].base_color * texel.rgb;
}

fn bvh_lobe(surface: BvhSurface) -> u32 {
    let m = surface.material;
    let rough_metallic = bvh_texture(bvh_materials[m].metallic_roughness_texture, surface.tex_coord).gb;
    return lobe_of(
        bvh_materials[m].metallic * rough_metallic.y,
        lobe_textured(bvh_materials[m].roughness, rough_metallic.x),
        bvh_materials[m].transmission,
        bvh_materials[m].index_of_refraction,
    );
}

fn bvh_emission(surface: BvhSurface) -> vec3f {
    let material = surface.material;
    let texel = bvh_texture(bvh_materials[material].emission_texture, surface.tex_coord);
    return bvh_materials[material].emission * texel.rgb;
}
