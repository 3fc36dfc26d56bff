// Twin of `resource::lights::gpu::Polygon`: a triangle or parallelogram that shines from its front, and how much light it
// gives.

struct Polygon {
    corner: vec3f,
    // 3 or 4
    corners: u32,
    // Sides that meet at the corner; the front is where u x v points to
    u: vec3f,
    // Share of the light's photons that start on this polygon of it and those before it
    until: f32,
    v: vec3f,
    area: f32,
    radiance: vec3f,
}

const POLYGON_PI: f32 = 3.14159265;
// Seen from further away than the root of this times its longest side a polygon is as good as a point, to a
// ten-thousandth, and rounding in the sum over its sides would be more than that.
const POLYGON_FAR: f32 = 4096.0;

// The angle between two corners as seen from the origin, times the cosine between n and the normal of the plane through both.
fn polygon_side(a: vec3f, b: vec3f, n: vec3f) -> f32 {
    let across = cross(a, b);
    let sine = length(across);
    if sine <= 0.0 {
        return 0.0;
    }
    return atan2(sine, dot(a, b)) * dot(across, n) / sine;
}

// Integral of the cosine over the directions in which the polygon's front is seen above the horizon from a surface element at
// p with normal n: Lambert's formula over the sides of the polygon, cut at the horizon (Baum, Rushmeier and Winget 1989,
// equation 11).
fn polygon_irradiance(polygon: Polygon, p: vec3f, n: vec3f) -> f32 {
    let first = polygon.corner - p;
    let front = cross(polygon.u, polygon.v);
    if dot(front, first) >= 0.0 {
        return 0.0;
    }
    let is_triangle = polygon.corners == 3u;
    let middle = first + select(0.5, 1.0 / 3.0, is_triangle) * (polygon.u + polygon.v);
    let squared = dot(middle, middle);
    let diagonal = polygon.u - polygon.v;
    let longest = max(dot(diagonal, diagonal), max(dot(polygon.u, polygon.u), dot(polygon.v, polygon.v)));
    if squared > POLYGON_FAR * longest {
        let direction = middle * inverseSqrt(squared);
        let cosines = max(0.0, dot(n, direction)) * -dot(normalize(front), direction);
        return polygon.area * cosines / squared;
    }
    var corners = array(
        first,
        first + polygon.u,
        first + select(polygon.u + polygon.v, polygon.v, is_triangle),
        first + polygon.v,
    );
    var sum = 0.0;
    // Where the polygon's outline came up through the horizon, and where it went down.
    var up = vec3f(0.0);
    var down = vec3f(0.0);
    for (var i = 0u; i < polygon.corners; i++) {
        let a = corners[i];
        let b = corners[select(i + 1u, 0u, i + 1u == polygon.corners)];
        let height_a = dot(n, a);
        let height_b = dot(n, b);
        if height_a <= 0.0 && height_b <= 0.0 {
            continue;
        }
        let crossing = mix(a, b, height_a / (height_a - height_b));
        let from_here = select(a, crossing, height_a <= 0.0);
        let to_there = select(b, crossing, height_b <= 0.0);
        if height_a <= 0.0 {
            up = crossing;
        }
        if height_b <= 0.0 {
            down = crossing;
        }
        sum += polygon_side(from_here, to_there, n);
    }
    // The side along the horizon closes the outline.
    sum += polygon_side(down, up, n);
    return max(0.0, -0.5 * sum);
}

// Distance at which a ray crosses the polygon's front; 1e38 if it does not.
fn polygon_crossed(polygon: Polygon, origin: vec3f, direction: vec3f) -> f32 {
    let across = cross(polygon.u, polygon.v);
    let towards = dot(across, direction);
    if towards >= 0.0 {
        return 1e38;
    }
    let t = dot(across, polygon.corner - origin) / towards;
    // Coordinates along the sides, which need not be perpendicular (Cramer).
    let at = origin + t * direction - polygon.corner;
    let scale = 1.0 / dot(across, across);
    let a = dot(cross(at, polygon.v), across) * scale;
    let b = dot(cross(polygon.u, at), across) * scale;
    let limit = select(max(a, b), a + b, polygon.corners == 3u);
    return select(1e38, t, t > 0.0 && min(a, b) >= 0.0 && limit <= 1.0);
}
