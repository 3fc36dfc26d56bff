// Fragment stage only: needs derivatives, so call it from uniform control flow, before any discard.

// Normal of the triangle that a fragment belongs to, towards neither side in particular.
fn surface_capture_normal(position: vec3f) -> vec3f {
    let n = cross(dpdx(position), dpdy(position));
    let length_squared = dot(n, n);
    return select(vec3f(0.0, 0.0, 1.0), n * inverseSqrt(length_squared), length_squared > 0.0);
}
