// The GGX distribution of facet normals (Walter et al. 2007), isotropic, about +z; v and h are unit vectors.

const GGX_PI: f32 = 3.14159265;

// Facets per solid angle with normal h: alpha^2 / (pi ((h_z^2 (alpha^2 - 1)) + 1)^2), written so that narrow lobes keep
// their digits: 1 - h_z^2 from h's horizontal part.
fn ggx_density(h: vec3f, alpha: f32) -> f32 {
    let squared = alpha * alpha;
    let spread = dot(h.xy, h.xy) + squared * h.z * h.z;
    return squared / (GGX_PI * spread * spread);
}

// Share of facets that are seen from v and not shadowed by others (Smith): 2 / (1 + sqrt(1 + alpha^2 tan^2)).
fn ggx_lit_share(v: vec3f, alpha: f32) -> f32 {
    let tangent_squared = dot(v.xy, v.xy) / max(v.z * v.z, 1e-20);
    return 2.0 / (1.0 + sqrt(1.0 + alpha * alpha * tangent_squared));
}

// Density per solid angle of the normals seen from v: D(h) G(v) max(0, v.h) / v_z.
fn ggx_seen_density(v: vec3f, h: vec3f, alpha: f32) -> f32 {
    return ggx_density(h, alpha) * ggx_lit_share(v, alpha) * max(0.0, dot(v, h)) / max(abs(v.z), 1e-10);
}

// A normal with that density (Heitz 2018): uniform on the projection of a hemisphere, in a space where alpha is 1.
fn ggx_sample_seen(v: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let stretched = normalize(vec3f(alpha * v.xy, v.z));
    let disc = sampling_disc(u);
    // The lower half of the disc is seen foreshortened by (1 + v_z) / 2.
    let up = ggx_upward(stretched);
    let across = cross(up, stretched);
    let half_width = sqrt(max(0.0, 1.0 - disc.x * disc.x));
    let share = 0.5 * (1.0 + stretched.z);
    let y = (1.0 - share) * half_width + share * disc.y;
    let z = sqrt(max(0.0, 1.0 - disc.x * disc.x - y * y));
    let n = disc.x * across + y * up + z * stretched;
    return normalize(vec3f(alpha * n.xy, max(1e-10, n.z)));
}

// The unit vector perpendicular to v that lies in the plane of v and +z, on the side of +z.
fn ggx_upward(v: vec3f) -> vec3f {
    let horizontal = dot(v.xy, v.xy);
    if horizontal < 1e-14 {
        return vec3f(1.0, 0.0, 0.0);
    }
    let length = sqrt(horizontal);
    return vec3f(-v.xy * (v.z / length), length);
}

// Share of the light from a direction of this cosine that facets which reflect all of it send on to each other: 1 minus the
// directional albedo. A fit of ours to a quadrature, the albedo within 1 % for cosines above 0.1, within 4 % for all.
fn ggx_loss(cosine: f32, alpha: f32) -> f32 {
    let c = saturate(cosine);
    let x = c / (c + 2.0 * alpha);
    let y = sqrt(alpha);
    let powers = y * vec4f(1.0, y, y * y, y * y * y);
    let c0 = vec4f(0.0594, 0.1448, 0.2399, -0.0542);
    let c1 = vec4f(8.7759, -30.6105, 37.0081, -14.0313);
    let c2 = vec4f(-18.7803, 58.2764, -55.7854, 15.5263);
    let c3 = vec4f(9.7538, -24.5042, 6.8186, 8.1526);
    return clamp(dot(powers, c0 + x * (c1 + x * (c2 + x * c3))), 0.0, 0.7);
}
