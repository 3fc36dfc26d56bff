// What hangs over the rim of a surface, as far as a view shows the rim. The module says what a view shows of a point:
// `boundary_goes_on(receiver, y, slab) -> bool`, whether the receiver's surface goes on at y, a point of its tangent plane.

// Points of the disc that are looked at, as densely as the kernel weighs.
const BOUNDARY_POINTS: u32 = 64u;
const BOUNDARY_GOLDEN_ANGLE: f32 = 2.399963230;
// No kernel counts for less than this: in the tip of a corner of 30 degrees a twelfth of it is on the surface.
const BOUNDARY_LEAST: f32 = 0.08;

// What is seen in the direction of y, and which way that is, or parallel rays go.
struct BoundarySight {
    position: vec3f,
    normal: vec3f,
    surface: u32,
    direction: vec3f,
}

// Whether what is seen says that the receiver's surface goes on at y.
fn boundary_says_on(receiver: Receiver, y: vec3f, seen: BoundarySight, slab: f32) -> bool {
    let off_plane = dot(seen.position - receiver.position, receiver.normal);
    if abs(off_plane) <= slab && dot(seen.normal, receiver.normal) >= SPLAT_NORMAL_AGREEMENT {
        return splat_shares(receiver.surface, seen.surface);
    }
    if dot(seen.direction, receiver.normal) * off_plane > 0.0 {
        // What is seen lies beyond the plane: nothing of the plane was in the way.
        return false;
    }
    // Something is before the plane. If the receiver is on its outer side and y on its inner one, the surface ends
    // against it.
    let is_before = dot(receiver.position - seen.position, seen.normal) > 0.0;
    let is_within = dot(y - seen.position, seen.normal) <= 0.0;
    return !(is_before && is_within);
}

// Share of a kernel of this radius around the receiver that lies on its surface. `start` turns the points that are looked at.
fn boundary_share(receiver: Receiver, radius: f32, start: f32) -> f32 {
    let frame = sampling_frame(receiver.normal);
    let slab = splat_slab(radius);
    var on = 0u;
    for (var i = 0u; i < BOUNDARY_POINTS; i++) {
        let distance = radius * splat_kernel_radius((f32(i) + 0.5) / f32(BOUNDARY_POINTS));
        let turn = start + BOUNDARY_GOLDEN_ANGLE * f32(i);
        let y = receiver.position + distance * (cos(turn) * frame[0] + sin(turn) * frame[1]);
        on += u32(boundary_goes_on(receiver, y, slab));
    }
    return max(f32(on) / f32(BOUNDARY_POINTS), BOUNDARY_LEAST);
}
