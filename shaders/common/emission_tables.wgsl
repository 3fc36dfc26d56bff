// Where a light's photons start: the square of the two random numbers that an emission is made of, in cells, each with the
// share of the light's photons that start there. The file that uses it binds `emission_tables`, one for each light.

struct EmissionTable {
    // Sums of shares up to the end of each column of cells
    columns: array<f32, EMISSION_CELLS>,
    // And, column by column, up to the end of each of its cells, as parts of the column's share
    rows: array<f32, EMISSION_CELL_TOTAL>,
}

struct EmissionStart {
    u: vec2f,
    cell: u32,
    // How many times as many photons start here as would if they were spread evenly
    boost: f32,
}

// Takes an evenly spread pair of numbers to one that is spread as the table says. Neighbours stay neighbours.
fn emission_start(light: u32, u: vec2f) -> EmissionStart {
    var column = 0u;
    while column + 1u < EMISSION_CELLS && u.x >= emission_tables[light].columns[column] {
        column++;
    }
    var before = 0.0;
    if column > 0u {
        before = emission_tables[light].columns[column - 1u];
    }
    let column_share = emission_tables[light].columns[column] - before;
    let x = clamp((u.x - before) / column_share, 0.0, EMISSION_BELOW_ONE);
    let first = column * EMISSION_CELLS;
    var row = 0u;
    while row + 1u < EMISSION_CELLS && u.y >= emission_tables[light].rows[first + row] {
        row++;
    }
    before = 0.0;
    if row > 0u {
        before = emission_tables[light].rows[first + row - 1u];
    }
    let row_share = emission_tables[light].rows[first + row] - before;
    let y = clamp((u.y - before) / row_share, 0.0, EMISSION_BELOW_ONE);
    let place = (vec2f(f32(column), f32(row)) + vec2f(x, y)) / f32(EMISSION_CELLS);
    let boost = f32(EMISSION_CELL_TOTAL) * column_share * row_share;
    return EmissionStart(min(place, vec2f(EMISSION_BELOW_ONE)), first + row, boost);
}

// The largest f32 below 1.
const EMISSION_BELOW_ONE: f32 = 0.99999994;
