// Makes the tables of reflections from what was counted: an invocation for each.

@group(0) @binding(0) var<uniform> params: UpdateParams;
@group(0) @binding(1) var<storage, read_write> counts: array<u32>;
// The same over the frames
@group(0) @binding(2) var<storage, read_write> history: array<f32>;
@group(0) @binding(3) var<storage, read_write> reflection_tables: array<ReflectionTable>;

@compute @workgroup_size(64)
fn update_reflections(@builtin(global_invocation_id) id: vec3u) {
    let table = id.x;
    if table >= REFLECTION_TABLES {
        return;
    }
    let at = table * REFLECTION_COUNTS;
    var weight = 0.0;
    for (var i = at; i < at + REFLECTION_COUNTS; i++) {
        history[i] = params.kept * history[i] + f32(counts[i]);
        counts[i] = 0u;
        weight += select(history[i], 0.0, i == at);
    }
    // Where nothing was seen, all cells are alike.
    let by_chance = SEEN_BY_CHANCE * max(weight, 1.0) / max(history[at], 1.0);
    let total = weight + by_chance * f32(REFLECTION_CELL_TOTAL);
    var end = 0.0;
    for (var column = 0u; column < REFLECTION_CELLS; column++) {
        let own = column * REFLECTION_CELLS;
        let before = end;
        for (var row = 0u; row < REFLECTION_CELLS; row++) {
            end += (history[at + 1u + own + row] + by_chance) / total;
            // Not yet a part of the column's share.
            reflection_tables[table].rows[own + row] = end - before;
        }
        reflection_tables[table].columns[column] = end;
        for (var row = 0u; row < REFLECTION_CELLS; row++) {
            reflection_tables[table].rows[own + row] /= end - before;
        }
    }
}
