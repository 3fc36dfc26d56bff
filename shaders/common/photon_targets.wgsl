// What caustic photons are aimed at: balls around specular surfaces, evenly in the solid angles, or the discs, that these
// fill. The file that uses it binds `targets`.

const PHOTON_TARGETS_MOST: u32 = 64u;
const PHOTON_TARGETS_LIGHTS: u32 = 64u;

struct PhotonTargets {
    // Centre and radius
    balls: array<vec4f, PHOTON_TARGETS_MOST>,
    // Of each light: its first photon, and how many it has
    ranges: array<vec2u, PHOTON_TARGETS_LIGHTS>,
    ball_count: u32,
}

struct Aim {
    // Unit direction, or place on the disc of parallel rays: (right, up, 0)
    at: vec3f,
    // Of a light's photons per solid angle, or per area of the disc; 0: there is nothing to aim at
    density: f32,
}

// Axis, and 1 - cos of the half angle, of the cone that a ball fills as seen from a point; 2: all around.
fn photon_target_cone(index: u32, eye: vec3f) -> vec4f {
    let ball = targets.balls[index];
    let toward = ball.xyz - eye;
    let squared = dot(toward, toward);
    let sine_squared = ball.w * ball.w / squared;
    if !(sine_squared < 1.0) {
        return vec4f(0.0, 0.0, 1.0, 2.0);
    }
    return vec4f(toward * inverseSqrt(squared), sine_squared / (1.0 + sqrt(1.0 - sine_squared)));
}

// Place and squared radius of the disc that a ball fills before parallel rays.
fn photon_target_disc(index: u32, right: vec3f, up: vec3f) -> vec4f {
    let ball = targets.balls[index];
    return vec4f(dot(ball.xyz, right), dot(ball.xyz, up), 0.0, ball.w * ball.w);
}

fn aim_from_point(eye: vec3f, u: vec2f) -> Aim {
    var total = 0.0;
    for (var i = 0u; i < targets.ball_count; i++) {
        total += photon_target_cone(i, eye).w;
    }
    let place = u.x * total;
    var chosen = 0u;
    var cone = photon_target_cone(0u, eye);
    var before = 0.0;
    while chosen + 1u < targets.ball_count && place >= before + cone.w {
        before += cone.w;
        chosen++;
        cone = photon_target_cone(chosen, eye);
    }
    if !(total > 0.0) {
        return Aim(cone.xyz, 0.0);
    }
    let v = clamp(place - before, 0.0, cone.w);
    let sine = sqrt(v * (2.0 - v));
    let phi = 2.0 * SAMPLING_PI * u.y;
    let local = vec3f(sine * cos(phi), sine * sin(phi), 1.0 - v);
    let direction = normalize(sampling_frame(cone.xyz) * local);
    // Where cones overlap each of them sends some.
    var overlapping = 1.0;
    for (var i = 0u; i < targets.ball_count; i++) {
        let other = photon_target_cone(i, eye);
        overlapping += select(0.0, 1.0, i != chosen && sampling_one_minus_cos(direction, other.xyz) <= other.w);
    }
    return Aim(direction, overlapping / (2.0 * SAMPLING_PI * total));
}

fn aim_along(right: vec3f, up: vec3f, u: vec2f) -> Aim {
    var total = 0.0;
    for (var i = 0u; i < targets.ball_count; i++) {
        total += photon_target_disc(i, right, up).w;
    }
    let place = u.x * total;
    var chosen = 0u;
    var disc = photon_target_disc(0u, right, up);
    var before = 0.0;
    while chosen + 1u < targets.ball_count && place >= before + disc.w {
        before += disc.w;
        chosen++;
        disc = photon_target_disc(chosen, right, up);
    }
    if !(total > 0.0) {
        return Aim(disc.xyz, 0.0);
    }
    let radius = sqrt(clamp(place - before, 0.0, disc.w));
    let phi = 2.0 * SAMPLING_PI * u.y;
    let at = disc.xy + radius * vec2f(cos(phi), sin(phi));
    var overlapping = 1.0;
    for (var i = 0u; i < targets.ball_count; i++) {
        let other = photon_target_disc(i, right, up);
        let apart = at - other.xy;
        overlapping += select(0.0, 1.0, i != chosen && dot(apart, apart) <= other.w);
    }
    return Aim(vec3f(at, 0.0), overlapping / (SAMPLING_PI * total));
}
