// Rays from the chosen texels, as dense as the cosine, or denser where indirect light comes from: one invocation a ray.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> lights: array<SurfaceLight>;
@group(0) @binding(2) var<storage, read> chosen: PathList;
@group(0) @binding(3) var<storage, read> incident: array<u32>;
@group(0) @binding(4) var<storage, read_write> rays: array<SurfaceRay>;

// A ray that asks nothing: it starts where nothing is.
const NOWHERE: vec3f = vec3f(0.0, 0.0, 64.0);

// A point on the square, and over how many times the cosine's density such are found there.
struct Guided {
    u: vec2f,
    density: f32,
}

// Photons, of which half of what there is to guide is guided: fewer say little of where light comes from.
const GUIDED_BY_HALF: f32 = 128.0;

// Cells are taken by the light that comes from there, and by as much as if they all were alike: the first number chooses one,
// and, stretched, the place in it.
fn guided(place: u32, u: vec2f) -> Guided {
    let first = place * INCIDENT_STRIDE;
    let photons = f32(incident[first + INCIDENT_CELLS]);
    var all = 0.0;
    for (var cell = 0u; cell < INCIDENT_CELLS; cell++) {
        all += f32(incident[first + cell]);
    }
    let share = params.guided * photons / (photons + GUIDED_BY_HALF);
    let of_light = share / max(all, 1.0);
    let even = (1.0 - share) / f32(INCIDENT_CELLS);
    var cell = 0u;
    var below = 0.0;
    var own = even + of_light * f32(incident[first]);
    while below + own <= u.x && cell < INCIDENT_CELLS - 1u {
        below += own;
        cell++;
        own = even + of_light * f32(incident[first + cell]);
    }
    let within = vec2f(clamp((u.x - below) / own, 0.0, HALTON_BELOW_ONE), u.y);
    let corner = vec2f(vec2u(cell % INCIDENT_SIDE, cell / INCIDENT_SIDE));
    return Guided((corner + within) / f32(INCIDENT_SIDE), own * f32(INCIDENT_CELLS));
}

@compute @workgroup_size(64)
fn spread_rays(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * params.row + id.x;
    if id.x >= params.row || index >= params.budget * params.ray_count {
        return;
    }
    let place = index / params.ray_count;
    if place >= chosen.count {
        rays[index] = SurfaceRay(NOWHERE, octahedral_pack(vec3f(0.0, 0.0, 1.0)), vec3f(0.0, 0.0, 1.0), 0u);
        return;
    }
    let texel = chosen.paths[place];
    let i = index % params.ray_count;
    let own = hash_u32(texel ^ hash_u32(params.sample_offset));
    let shift = vec2f(hash_unit(own, 0u), hash_unit(own, 1u));
    let normal = lights[texel].normal;
    let frame = sampling_frame(normal);
    var direction = cosine_direction(frame, i, params.ray_count, shift);
    var density = 1.0;
    if params.guided > 0.0 {
        let u = fract(vec2f((f32(i) + 0.5) / f32(params.ray_count), halton(i, 0u)) + shift);
        let ray = guided(place, min(u, vec2f(HALTON_BELOW_ONE)));
        direction = normalize(frame * sampling_cosine(min(ray.u, vec2f(HALTON_BELOW_ONE))));
        density = ray.density;
    }
    rays[index] = SurfaceRay(lights[texel].position, octahedral_pack(normal), direction, bitcast<u32>(1.0 / density));
}
