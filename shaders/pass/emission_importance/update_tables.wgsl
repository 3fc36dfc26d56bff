// Makes the tables of emission cells from what was counted: a workgroup for each light, an invocation for each cell.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// Of each cell: paths that started there and hops of theirs that were seen, over the frames
@group(0) @binding(2) var<storage, read_write> history: array<vec2f>;
@group(0) @binding(3) var<storage, read_write> emission_tables: array<EmissionTable>;

// Until so many hops of a cell's paths were seen, it counts as much like the mean of all cells: what few hops say is chance.
const SEEN_BY_CHANCE: f32 = 4.0;

var<workgroup> shares: array<f32, EMISSION_CELL_TOTAL>;
var<workgroup> sums: array<vec2f, EMISSION_CELL_TOTAL>;
var<workgroup> columns: array<f32, EMISSION_CELLS>;

// The error of a mean of samples is least where these are taken in proportion to the root of the mean square of their values:
// here of the hops that are seen of a path, one or none.
@compute @workgroup_size(EMISSION_CELL_TOTAL)
fn update_tables(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) cell: u32) {
    let light = group.x;
    let at = light * EMISSION_CELL_TOTAL + cell;
    let counted = params.kept * history[at] + vec2f(f32(counts[2u * at]), f32(counts[2u * at + 1u]));
    history[at] = counted;
    counts[2u * at] = 0u;
    counts[2u * at + 1u] = 0u;
    sums[cell] = counted;
    workgroupBarrier();
    for (var half = EMISSION_CELL_TOTAL / 2u; half > 0u; half /= 2u) {
        if cell < half {
            sums[cell] += sums[cell + half];
        }
        workgroupBarrier();
    }
    // Paths of which so many hops are seen, were all cells alike.
    let paths_by_chance = SEEN_BY_CHANCE * sums[0].x / max(sums[0].y, 1.0);
    let is_any_seen = f32(sums[0].y > 0.0);
    shares[cell] = is_any_seen * sqrt((counted.y + SEEN_BY_CHANCE) / max(counted.x + paths_by_chance, 1.0));
    workgroupBarrier();
    let column = cell / EMISSION_CELLS;
    let row = cell % EMISSION_CELLS;
    if row == 0u {
        var sum = 0.0;
        for (var i = 0u; i < EMISSION_CELLS; i++) {
            sum += shares[cell + i];
        }
        columns[column] = sum;
    }
    workgroupBarrier();
    var total = 0.0;
    for (var i = 0u; i < EMISSION_CELLS; i++) {
        total += columns[i];
    }
    // Where nothing was seen, all cells are alike.
    let directed = select(0.0, params.share, total > 0.0);
    let scale = directed / max(total, 1e-30);
    let even = (1.0 - directed) / f32(EMISSION_CELLS);
    var sum = 0.0;
    for (var i = 0u; i <= row; i++) {
        sum += scale * shares[column * EMISSION_CELLS + i] + even / f32(EMISSION_CELLS);
    }
    emission_tables[light].rows[cell] = sum / (scale * columns[column] + even);
    if row == 0u {
        var end = 0.0;
        for (var i = 0u; i <= column; i++) {
            end += scale * columns[i] + even;
        }
        emission_tables[light].columns[column] = end;
    }
}
