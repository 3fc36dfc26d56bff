// Ray against one environment map, texel by texel, over its depth hierarchy: whole squares of texels that lie in front of
// the ray, or behind it, are stepped over at once.
//
// On a face of the cube the ray is a straight line, and depth is the distance z along the face's axis. A texel is a piece
// of plane, and with h(t) = n . p(t) / n . s (p a point of the ray, s the stored point, n the normal; all relative to the
// map's centre) the ray is in front of the plane where h < 1, and h is linear in t. A range of inverse depth [least,
// greatest] keeps h between least z and greatest z, where a plane seen at a grazing angle would reach anywhere. Behind the
// surface, h is how many times as deep as the surface the ray is.

// A crossing may fall between two texels whose planes do not quite meet: by up to so many texels it still counts.
const HIERARCHY_CRACK: f32 = 0.25;
// Bodies are taken to reach so far behind what a map shows of them, as a factor of depth: a ray that comes out from behind
// a rim nearer to it than that has gone through the body. Less lets light through closed doors, more blocks what passes
// behind thin things (`docs/tracing.md`).
const HIERARCHY_THICKNESS: f32 = 1.08;
// A ray starts on a surface, so that it begins with small squares.
const HIERARCHY_FIRST_LEVEL: u32 = 3u;
// Less depth than this there is not: a ray past the map's centre goes from one face to the opposite one.
const HIERARCHY_NEAREST: f32 = 0x1p-14;
// A straight line crosses at most four faces; more only where it runs along an edge.
const HIERARCHY_FACES: u32 = 8u;
// Beyond the walk through the largest map at its finest level.
const HIERARCHY_STEPS: u32 = 32768u;
// Before a crossing that is not certain, so much is not certain either: this many texels, and no less than this, unit
// frame.
const HIERARCHY_UNSURE: f32 = 6.0;
const HIERARCHY_LEAST_UNSURE: f32 = 0x1p-8;

// A ray in the frame of a face, scaled so that p.xy / p.z is the place on the face in texels.
struct FaceRay {
    x: vec3f,
    r: vec3f,
    // z^2 times the speed of the place
    turn: vec2f,
}

fn hierarchy_face_ray(face: u32, x: vec3f, r: vec3f) -> FaceRay {
    let half_size = 0.5 * f32(params.map_size);
    let fx = env_map_face_frame(face, x);
    let fr = env_map_face_frame(face, r);
    let px = vec3f(half_size * (fx.xy + fx.z), fx.z);
    let pr = vec3f(half_size * (fr.xy + fr.z), fr.z);
    return FaceRay(px, pr, pr.xy * px.z - px.xy * pr.z);
}

// Where the ray leaves a face, and into which.
struct FaceExit {
    t: f32,
    face: u32,
}

// Of a linear function that is not negative inside: where it becomes so; never, if it grows.
fn hierarchy_fall(value: f32, slope: f32) -> f32 {
    return select(1e30, -value / slope, slope < 0.0);
}

fn hierarchy_exit(face: u32, ray: FaceRay) -> FaceExit {
    let size = f32(params.map_size);
    let right = cube_face_right(face);
    let up = cube_face_up(face);
    var exit = FaceExit(hierarchy_fall(ray.x.z - HIERARCHY_NEAREST, ray.r.z), face ^ 1u);
    let low = vec2f(hierarchy_fall(ray.x.x, ray.r.x), hierarchy_fall(ray.x.y, ray.r.y));
    let high = vec2f(
        hierarchy_fall(size * ray.x.z - ray.x.x, size * ray.r.z - ray.r.x),
        hierarchy_fall(size * ray.x.z - ray.x.y, size * ray.r.z - ray.r.y),
    );
    if low.x < exit.t {
        exit = FaceExit(low.x, cube_face_point(-right).face);
    }
    if high.x < exit.t {
        exit = FaceExit(high.x, cube_face_point(right).face);
    }
    if low.y < exit.t {
        exit = FaceExit(low.y, cube_face_point(up).face);
    }
    if high.y < exit.t {
        exit = FaceExit(high.y, cube_face_point(-up).face);
    }
    return exit;
}

// Where the ray crosses a line of constant place along one axis, if it moves towards it.
fn hierarchy_bound(x: f32, r: f32, z: f32, rz: f32, turn: f32, bound: f32) -> f32 {
    let toward = r - bound * rz;
    return select(1e30, (bound * z - x) / toward, toward * turn > 0.0);
}

fn hierarchy_cell(ray: FaceRay, t: f32) -> vec2i {
    let p = ray.x + t * ray.r;
    let place = p.xy / max(p.z, HIERARCHY_NEAREST);
    return vec2i(clamp(place, vec2f(0.0), vec2f(f32(params.map_size) - 0.5)));
}

fn hierarchy_range(layer: u32, cell: vec2i, level: u32) -> u32 {
    env_map_fetches++;
    return textureLoad(depth_ranges, cell, layer, level).x;
}

// 1 - h of a plane at t, h kept within what the texel's range allows: not negative in front.
fn hierarchy_height(plane: vec2f, range: DepthRange, ray: FaceRay, t: f32) -> f32 {
    let z = ray.x.z + t * ray.r.z;
    return 1.0 - clamp(plane.x + t * plane.y, range.least * z, range.greatest * z);
}

// A crossing at t, and whether the texels around the place show the same surface there.
fn hierarchy_crossing(found: MapTrace, is_certain: bool, ray: FaceRay, cell: vec2i, bits: u32, start: f32) -> MapTrace {
    var result = found;
    let t = result.hit.distance;
    let p = ray.x + t * ray.r;
    let in_texel = p.xy / p.z - vec2f(cell);
    let is_sure = depth_range_agrees(bits, u32(in_texel.x > 0.5) + 2u * u32(in_texel.y > 0.5));
    if is_certain && is_sure {
        result.kind = HIT_SURFACE;
        if !depth_range_is_flat(bits) && params.doubts_normals == 1u {
            result.hit.kind = HIT_TENTATIVE;
        }
    } else if is_certain {
        let texel = 2.0 * length(result.hit.position) / f32(params.map_size);
        result.free = clamp(t - max(HIERARCHY_LEAST_UNSURE, HIERARCHY_UNSURE * texel), start, result.free);
    }
    return result;
}

fn hierarchy_map(map: u32, x: vec3f, r: vec3f, start: f32, end: f32, starts_in_front: bool) -> MapTrace {
    var result = MapTrace(HIT_LOST, start, hit_nothing(HIT_LOST));
    var in_front = starts_in_front;
    var is_certain = starts_in_front;
    var t = start;
    // Of the texel walked through last, h = x + t y; nothing crosses this one
    var last_plane = vec2f(0.0);
    var last_surface: SurfaceTexel;
    var last_cell = vec2i(0);
    var last_bits = 0u;
    // While the ray is behind: h where it left the last texel
    var behind = HIERARCHY_THICKNESS;
    let first = x + start * r;
    var face = cube_face_point(select(first, r, dot(first, first) < 1e-12)).face;
    let top = u32(firstLeadingBit(params.map_size - 1u)) + 1u;
    var steps = 0u;
    for (var i = 0u; i < HIERARCHY_FACES && t < end; i++) {
        let layer = 6u * map + face;
        let ray = hierarchy_face_ray(face, x, r);
        let exit = hierarchy_exit(face, ray);
        let face_end = min(exit.t, end);
        let step = select(vec2i(-1), vec2i(1), ray.turn > vec2f(0.0));
        var level = min(HIERARCHY_FIRST_LEVEL, top);
        var cell = hierarchy_cell(ray, t) >> vec2u(level);
        while t < face_end && steps < HIERARCHY_STEPS && env_map_fetches < params.most_fetches {
            steps++;
            trace_steps++;
            let bound = vec2f((cell + max(step, vec2i(0))) << vec2u(level));
            let cross_x = hierarchy_bound(ray.x.x, ray.r.x, ray.x.z, ray.r.z, ray.turn.x, bound.x);
            let cross_y = hierarchy_bound(ray.x.y, ray.r.y, ray.x.z, ray.r.z, ray.turn.y, bound.y);
            let out = max(t, min(min(cross_x, cross_y), face_end));
            let bits = hierarchy_range(layer, cell, level);
            let range = depth_range_unpack(bits);
            let z = vec2f(ray.x.z + t * ray.r.z, ray.x.z + out * ray.r.z);
            let all_in_front = range.greatest * max(z.x, z.y) < 1.0;
            if all_in_front {
                if !in_front && behind < HIERARCHY_THICKNESS {
                    return hierarchy_blocked(result, last_surface, x, r, t);
                }
                in_front = true;
                last_plane = vec2f(0.0);
            } else if in_front || range.least * min(z.x, z.y) < HIERARCHY_THICKNESS {
                if level > 0u {
                    level--;
                    cell = clamp(hierarchy_cell(ray, t) >> vec2u(level), 2 * cell, 2 * cell + 1);
                    continue;
                }
                let surface = surface_texel_unpack(env_map_load(map, face, vec2u(cell)));
                let middle = 2.0 * (vec2f(cell) + 0.5) / f32(params.map_size) - 1.0;
                let own = env_map_plane(surface, face, middle);
                let fx = env_map_face_frame(face, x);
                let fr = env_map_face_frame(face, r);
                let plane = vec2f(dot(own, fx), dot(own, fr));
                let height = vec2f(hierarchy_height(plane, range, ray, t), hierarchy_height(plane, range, ray, out));
                // Where the ray meets the plane, anywhere.
                let meets = (1.0 - plane.x) / plane.y;
                if in_front && height.x < 0.0 {
                    let crack = HIERARCHY_CRACK * z.x * z.x / max(max(abs(ray.turn.x), abs(ray.turn.y)), 1e-9);
                    let last_meets = (1.0 - last_plane.x) / last_plane.y;
                    if plane.y > 0.0 && t - meets <= crack {
                        result.hit = hierarchy_hit(surface, x, r, max(meets, start));
                        return hierarchy_crossing(result, is_certain, ray, cell, bits, start);
                    }
                    if last_plane.y > 0.0 && last_meets - t <= crack {
                        result.hit = hierarchy_hit(last_surface, x, r, max(last_meets, t));
                        return hierarchy_crossing(result, is_certain, ray, last_cell, last_bits, start);
                    }
                    // A plane that the ray rises from, and the texel that it starts in, are the surface it has left.
                    let rises = plane.y <= 0.0 && meets - t <= crack;
                    if !rises && t > start {
                        in_front = false;
                        is_certain = false;
                    }
                } else if height.x >= 0.0 {
                    if !in_front && behind < HIERARCHY_THICKNESS {
                        return hierarchy_blocked(result, last_surface, x, r, t);
                    }
                    in_front = true;
                }
                if in_front && height.x >= 0.0 && height.y < 0.0 {
                    let between = mix(t, out, height.x / (height.x - height.y));
                    let is_on_plane = meets >= t && meets <= out;
                    result.hit = hierarchy_hit(surface, x, r, select(between, meets, is_on_plane));
                    return hierarchy_crossing(result, is_certain, ray, cell, bits, start);
                }
                if !in_front && height.y >= 0.0 {
                    // Through the plane from behind: whatever the ray met, it did not come out here.
                    return hierarchy_blocked(result, surface, x, r, clamp(meets, t, out));
                }
                behind = 1.0 - height.y;
                last_plane = plane;
                last_surface = surface;
                last_cell = cell;
                last_bits = bits;
            }
            if !in_front && range.least * min(z.x, z.y) >= HIERARCHY_THICKNESS {
                behind = HIERARCHY_THICKNESS;
            }
            if in_front && is_certain {
                result.free = out;
            }
            t = out;
            if out >= face_end {
                break;
            }
            let before = cell >> vec2u(1u);
            if cross_x <= cross_y {
                cell.x += step.x;
            } else {
                cell.y += step.y;
            }
            if any(cell < vec2i(0)) || any((cell << vec2u(level)) >= vec2i(i32(params.map_size))) {
                break;
            }
            if any((cell >> vec2u(1u)) != before) && level < top {
                level++;
                cell = cell >> vec2u(1u);
            }
        }
        if steps >= HIERARCHY_STEPS || env_map_fetches >= params.most_fetches {
            return result;
        }
        t = max(t, face_end);
        face = exit.face;
    }
    if is_certain && t >= end {
        result.kind = HIT_ESCAPED;
        result.free = end;
    }
    return result;
}

fn hierarchy_hit(surface: SurfaceTexel, x: vec3f, r: vec3f, t: f32) -> Hit {
    return trace_hit(surface, t, x + t * r);
}

// The ray comes out through a surface from behind, or close behind its rim: through whatever body that surface belongs to.
// What it met was the body's other side, which no map need show, at about this place.
fn hierarchy_blocked(found: MapTrace, surface: SurfaceTexel, x: vec3f, r: vec3f, t: f32) -> MapTrace {
    var result = found;
    result.hit = hierarchy_hit(surface, x, r, t);
    result.hit.kind = HIT_TENTATIVE;
    if dot(surface.normal, r) > 0.0 {
        result.hit.normal = -surface.normal;
        result.hit.lobe ^= HIT_BACK;
    }
    return result;
}
