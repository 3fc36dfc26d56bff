// How a path leaves a diffuse surface as a table says. The file that uses it binds `reflection_tables`.

struct ReflectionStart {
    u: vec2f,
    // How many times as many photons leave this way as would if they were spread evenly
    boost: f32,
}

// Takes an evenly spread pair of numbers to one that is spread as the table says. Neighbours stay neighbours.
fn reflection_start(table: u32, u: vec2f) -> ReflectionStart {
    var column = 0u;
    while column + 1u < REFLECTION_CELLS && u.x >= reflection_tables[table].columns[column] {
        column++;
    }
    var before = 0.0;
    if column > 0u {
        before = reflection_tables[table].columns[column - 1u];
    }
    let column_share = reflection_tables[table].columns[column] - before;
    let x = clamp((u.x - before) / column_share, 0.0, REFLECTION_BELOW_ONE);
    let first = column * REFLECTION_CELLS;
    var row = 0u;
    while row + 1u < REFLECTION_CELLS && u.y >= reflection_tables[table].rows[first + row] {
        row++;
    }
    before = 0.0;
    if row > 0u {
        before = reflection_tables[table].rows[first + row - 1u];
    }
    let row_share = reflection_tables[table].rows[first + row] - before;
    let y = clamp((u.y - before) / row_share, 0.0, REFLECTION_BELOW_ONE);
    let place = (vec2f(f32(column), f32(row)) + vec2f(x, y)) / f32(REFLECTION_CELLS);
    let boost = f32(REFLECTION_CELL_TOTAL) * column_share * row_share;
    return ReflectionStart(min(place, vec2f(REFLECTION_BELOW_ONE)), boost);
}

// The largest f32 below 1.
const REFLECTION_BELOW_ONE: f32 = 0.99999994;
