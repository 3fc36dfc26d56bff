// A quad in the surface plane of each photon (Yao et al., soft shadows and image-space photon mapping, section 3.3).

// A little larger than the disc: receivers in the slab project beside it.
const QUAD_MARGIN: f32 = 1.1;

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Corner {
    let photon = photons[params.first_slot + index];
    let radius = splat_radius(params.bandwidth, photon);
    if !(radius > 0.0) {
        return raster_nothing();
    }
    let normal = octahedral_unpack(photon.normal);
    let side = vec2f(f32(corner & 1u), f32(corner >> 1u)) * 2.0 - 1.0;
    let frame = sampling_frame(normal);
    return raster_corner(photon, radius, normal, QUAD_MARGIN * radius * (side.x * frame[0] + side.y * frame[1]));
}
