// Adding up photons, for as many receivers at once as `Receivers` and `Surfaces` hold. The module brings
// `splats`, the sorted photons.

// Receivers by coordinate, and what they have gathered.
struct Gathered {
    x: Receivers,
    y: Receivers,
    z: Receivers,
    normal_x: Receivers,
    normal_y: Receivers,
    normal_z: Receivers,
    surface: Surfaces,
    red: Receivers,
    green: Receivers,
    blue: Receivers,
    // Red, green and blue by the radii of the kernels that brought them
    radius: Receivers,
}

fn gather_splat(g: ptr<function, Gathered>, index: u32, last: u32) {
    let splat = splats[min(index, last)];
    let n = octahedral_unpack(splat.normal);
    let dx = (*g).x - splat.position.x;
    let dy = (*g).y - splat.position.y;
    let dz = (*g).z - splat.position.z;
    let inverse = splat_inverse(splat);
    let q = (dx * dx + dy * dy + dz * dz) * inverse;
    let off_plane = abs(dx * n.x + dy * n.y + dz * n.z);
    let agreement = (*g).normal_x * n.x + (*g).normal_y * n.y + (*g).normal_z * n.z;
    let radius = inverseSqrt(inverse);
    let is_one = f32(index <= last);
    var weight = is_one * splat_weight(q, off_plane, agreement, splat_slab(radius));
    if splat_keeps_to_surfaces {
        let own = Surfaces(splat.inverse_radius_squared & SPLAT_SURFACE_BITS);
        let is_shared = (own == (*g).surface) | (own == Surfaces(0u)) | ((*g).surface == Surfaces(0u));
        weight = select(Receivers(0.0), weight, is_shared);
    }
    let strength = splat.strength;
    (*g).red += strength.x * weight;
    (*g).green += strength.y * weight;
    (*g).blue += strength.z * weight;
    (*g).radius += (strength.x + strength.y + strength.z) * radius * weight;
}

fn gather_four(g: ptr<function, Gathered>, index: u32, last: u32) {
    gather_splat(g, index, last);
    gather_splat(g, index + 1u, last);
    gather_splat(g, index + 2u, last);
    gather_splat(g, index + 3u, last);
}

fn gather_sixteen(g: ptr<function, Gathered>, index: u32, last: u32) {
    gather_four(g, index, last);
    gather_four(g, index + 4u, last);
    gather_four(g, index + 8u, last);
    gather_four(g, index + 12u, last);
}

// Adds up the photons from `first` to before `end`. Sixty-four a turn while there are as many: adapters may end a shader's loops
// after 65 535 turns in all. Twin of `MOST_SPLATS`.
fn gather_range(g: ptr<function, Gathered>, first: u32, end: u32) {
    var i = first;
    for (; i + 64u <= end; i += 64u) {
        gather_sixteen(g, i, end - 1u);
        gather_sixteen(g, i + 16u, end - 1u);
        gather_sixteen(g, i + 32u, end - 1u);
        gather_sixteen(g, i + 48u, end - 1u);
    }
    for (; i < end; i += 16u) {
        gather_sixteen(g, i, end - 1u);
    }
}
