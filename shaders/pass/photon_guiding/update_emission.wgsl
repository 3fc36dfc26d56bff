// Makes the tables of emissions from what was counted: a workgroup for each light, an invocation for each cell.

@group(0) @binding(0) var<uniform> params: UpdateParams;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// The same over the frames
@group(0) @binding(2) var<storage, read_write> history: array<f32>;
@group(0) @binding(3) var<storage, read_write> emission_tables: array<EmissionTable>;

var<workgroup> shares: array<f32, EMISSION_CELL_TOTAL>;
var<workgroup> sums: array<vec2f, EMISSION_CELL_TOTAL>;
var<workgroup> columns: array<f32, EMISSION_CELLS>;

@compute @workgroup_size(EMISSION_CELL_TOTAL)
fn update_emission(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) cell: u32) {
    let light = group.x;
    let at = EMISSION_COUNTS * (light * EMISSION_CELL_TOTAL + cell);
    for (var i = at; i < at + EMISSION_COUNTS; i++) {
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
    // Where nothing was seen, all cells are alike.
    shares[cell] = counted.x + SEEN_BY_CHANCE * max(sums[0].x, 1.0) / max(sums[0].y, 1.0);
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
    var end = 0.0;
    for (var i = 0u; i <= row; i++) {
        end += shares[column * EMISSION_CELLS + i];
    }
    emission_tables[light].rows[cell] = end / columns[column];
    if row == 0u {
        end = 0.0;
        for (var i = 0u; i <= column; i++) {
            end += columns[i];
        }
        emission_tables[light].columns[column] = end / total;
    }
}
