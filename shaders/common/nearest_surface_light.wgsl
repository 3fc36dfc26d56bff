// The light that an impact belongs to: the nearest one with an area that faces the same way, by a distance that counts off the
// impact's plane more than along it. The module brings `lights`, `grid` and `cells`: of each cell the first of its entries, and
// one more; behind them the entries, indices of lights.

const NO_LIGHT: u32 = 0xffffffffu;
// Cosine of the largest angle between the normals of an impact and of its light, if there is a light within it.
const SAME_WAY: f32 = 0.5;
// How much more a distance off the plane of an impact counts than one along it, squared.
const OFF_PLANE: f32 = 30.0;

struct Nearest {
    light: u32,
    distance_squared: f32,
}

// The nearer of what was found and what a cell holds that faces the same way.
fn nearest_in_cell(found: Nearest, cell: vec3u, p: vec3f, n: vec3f) -> Nearest {
    var nearest = found;
    let index = (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x;
    let entries = grid.cells.x * grid.cells.y * grid.cells.z + 1u;
    for (var i = cells[index]; i < cells[index + 1u]; i++) {
        let light = cells[entries + i];
        let away = lights[light].position - p;
        let off_plane = dot(away, n);
        let distance_squared = dot(away, away) + OFF_PLANE * off_plane * off_plane;
        let is_kept = lights[light].area > 0.0 && dot(lights[light].normal, n) >= SAME_WAY;
        if is_kept && distance_squared < nearest.distance_squared {
            nearest = Nearest(light, distance_squared);
        }
    }
    return nearest;
}

// The nearest light that faces the same way, by rings of cells around the point; where none does, the nearest that faces least
// apart.
fn nearest_light(p: vec3f, n: vec3f) -> u32 {
    let last = vec3i(grid.cells) - 1;
    let own = clamp(vec3i(floor((p - grid.origin) / grid.cell)), vec3i(0), last);
    let rings = max(max(last.x, last.y), last.z);
    var nearest = Nearest(NO_LIGHT, 3e38);
    for (var ring = 0; ring <= rings; ring++) {
        let low = max(own - ring, vec3i(0));
        let high = min(own + ring, last);
        for (var z = low.z; z <= high.z; z++) {
            for (var y = low.y; y <= high.y; y++) {
                let is_shell = abs(z - own.z) == ring || abs(y - own.y) == ring;
                // Inside, only both ends of a row are of this ring.
                let step = select(max(2 * ring, 1), 1, is_shell);
                let first = select(own.x - ring, low.x, is_shell);
                for (var x = first; x <= high.x; x += step) {
                    if x >= 0 {
                        nearest = nearest_in_cell(nearest, vec3u(vec3i(x, y, z)), p, n);
                    }
                }
            }
        }
        // What lies further out is further away than that.
        let reach = f32(ring) * grid.cell;
        if nearest.distance_squared <= reach * reach {
            return nearest.light;
        }
    }
    if nearest.light != NO_LIGHT {
        return nearest.light;
    }
    for (var light = 0u; light < grid.count; light++) {
        let away = lights[light].position - p;
        let apart = 1.0 - dot(lights[light].normal, n);
        // Lengths in the unit frame are of the order of 1.
        let cost = dot(away, away) + 64.0 * apart;
        if lights[light].area > 0.0 && cost < nearest.distance_squared {
            nearest = Nearest(light, cost);
        }
    }
    return nearest.light;
}
