// A flattened icosahedron around each photon: what covers the ball within the slab from any side, so that surfaces that
// turn away from the photon's plane are reached as well. Of its faces those behind are drawn, so that an eye inside sees it.

// Over the half axes of the ellipsoid that the icosahedron holds: the inverse of its inscribed sphere's radius.
const VOLUME_MARGIN: f32 = 1.26;
// Half axes over radius and slab. The ball's part in the slab fits: (1 - 1/16) / 1.21 + 1 / 2.11^2 < 1.
const VOLUME_ACROSS: f32 = 1.1;
const VOLUME_UP: f32 = 2.11;
// Of an icosahedron in the unit sphere: height of its two rings of five, and their radius.
const VOLUME_RING_HEIGHT: f32 = 0.447213595;
const VOLUME_RING_RADIUS: f32 = 0.894427191;
const VOLUME_FIFTH: f32 = 1.256637061;

// Corner 0 is the top, 1 to 5 the upper ring, 6 to 10 the lower one, turned by half a step, 11 the bottom.
fn volume_corner(index: u32) -> vec3f {
    if index == 0u || index == 11u {
        return vec3f(0.0, 0.0, select(-1.0, 1.0, index == 0u));
    }
    let is_upper = index <= 5u;
    let turn = VOLUME_FIFTH * (f32(index) + select(0.5, 0.0, is_upper));
    let height = select(-VOLUME_RING_HEIGHT, VOLUME_RING_HEIGHT, is_upper);
    return vec3f(VOLUME_RING_RADIUS * vec2f(cos(turn), sin(turn)), height);
}

// Corners of face 0 to 19, counter-clockwise from outside: caps, then the band between the rings.
fn volume_face(face: u32) -> vec3u {
    let i = face % 5u;
    let next = (i + 1u) % 5u;
    switch face / 5u {
        case 0u: { return vec3u(0u, 1u + i, 1u + next); }
        case 1u: { return vec3u(11u, 6u + next, 6u + i); }
        case 2u: { return vec3u(1u + i, 6u + i, 1u + next); }
        default: { return vec3u(1u + next, 6u + i, 6u + next); }
    }
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) index: u32) -> Corner {
    let photon = photons[params.first_slot + index];
    let radius = splat_radius(params.bandwidth, photon);
    if !(radius > 0.0) {
        return raster_nothing();
    }
    let normal = octahedral_unpack(photon.normal);
    let at = VOLUME_MARGIN * volume_corner(volume_face(corner / 3u)[corner % 3u]);
    let frame = sampling_frame(normal);
    let across = VOLUME_ACROSS * radius * (at.x * frame[0] + at.y * frame[1]);
    return raster_corner(photon, radius, normal, across + VOLUME_UP * splat_slab(radius) * at.z * normal);
}
