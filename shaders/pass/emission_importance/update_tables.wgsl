// Makes the tables of emission cells and of reflections from what was counted: a workgroup for each light, an invocation for each
// emission cell.

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// The same over the frames
@group(0) @binding(2) var<storage, read_write> history: array<f32>;
@group(0) @binding(3) var<storage, read_write> emission_tables: array<EmissionTable>;
@group(0) @binding(4) var<storage, read_write> reflection_tables: array<ReflectionTable>;

// Each cell has so many hops beside those that were seen, of the mean weight: what few hops say is chance.
const SEEN_BY_CHANCE: f32 = 4.0;

var<workgroup> shares: array<f32, EMISSION_CELL_TOTAL>;
var<workgroup> sums: array<vec2f, EMISSION_CELL_TOTAL>;
var<workgroup> columns: array<f32, EMISSION_CELLS>;

// A cell's share is the mean over the tiles of the view of its part in what they show. Where there are as many photons in one
// tile as in another, all are as certain.
@compute @workgroup_size(EMISSION_CELL_TOTAL)
fn update_tables(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) cell: u32) {
    let light = group.x;
    let table = light * EMISSION_CELL_TOTAL + cell;
    let at = table * CELL_COUNTS;
    for (var i = at; i < at + CELL_COUNTS; i++) {
        history[i] = params.kept * history[i] + f32(counts[i]);
        counts[i] = 0u;
    }
    let counted = vec2f(history[at], history[at + 1u]);
    sums[cell] = counted;
    workgroupBarrier();
    for (var half = EMISSION_CELL_TOTAL / 2u; half > 0u; half /= 2u) {
        if cell < half {
            sums[cell] += sums[cell + half];
        }
        workgroupBarrier();
    }
    shares[cell] = counted.x + SEEN_BY_CHANCE * sums[0].x / max(sums[0].y, 1.0);
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

// The tables of reflections, an invocation for each.
@compute @workgroup_size(64)
fn update_reflections(@builtin(global_invocation_id) id: vec3u) {
    let table = id.x;
    if table >= REFLECTION_TABLE_TOTAL {
        return;
    }
    let at = REFLECTION_COUNTS_FROM + table * REFLECTION_COUNTS;
    var weight = 0.0;
    for (var i = at; i < at + REFLECTION_COUNTS; i++) {
        history[i] = params.kept * history[i] + f32(counts[i]);
        counts[i] = 0u;
        weight += select(history[i], 0.0, i == at);
    }
    let by_chance = SEEN_BY_CHANCE * max(weight, 1.0) / max(history[at], 1.0);
    let scale = params.share / (weight + by_chance * f32(REFLECTION_CELL_TOTAL));
    let even = (1.0 - params.share) / f32(REFLECTION_CELL_TOTAL) + scale * by_chance;
    var end = 0.0;
    for (var column = 0u; column < REFLECTION_CELLS; column++) {
        let own = column * REFLECTION_CELLS;
        let before = end;
        for (var row = 0u; row < REFLECTION_CELLS; row++) {
            end += scale * history[at + 1u + own + row] + even;
            // Not yet a part of the column's share.
            reflection_tables[table].rows[own + row] = end - before;
        }
        reflection_tables[table].columns[column] = end;
        for (var row = 0u; row < REFLECTION_CELLS; row++) {
            reflection_tables[table].rows[own + row] /= end - before;
        }
    }
}
