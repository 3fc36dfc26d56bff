// Where a light's photons start: the square of the two random numbers that an emission is made of, in cells, each with the
// share of the light's photons that start there. The file that uses it binds `emission_tables`, one for each light.

struct EmissionTable {
    // Sums of shares up to the end of each column of cells
    columns: array<f32, EMISSION_CELLS>,
    // And, column by column, up to the end of each of its cells, as parts of the column's share
    rows: array<f32, EMISSION_CELL_TOTAL>,
}

// Takes an evenly spread pair of numbers to one that is spread as a table says. Neighbours stay neighbours.
fn emission_place(light: u32, u: vec2f) -> vec2f {
    var column = 0u;
    while column + 1u < EMISSION_CELLS && u.x >= emission_tables[light].columns[column] {
        column++;
    }
    let first = column * EMISSION_CELLS;
    var row = 0u;
    while row + 1u < EMISSION_CELLS && u.y >= emission_tables[light].rows[first + row] {
        row++;
    }
    let before = emission_before(light, column, row);
    let share = emission_share(light, column, row);
    let within = clamp((u - before) / share, vec2f(0.0), vec2f(EMISSION_BELOW_ONE));
    return (vec2f(f32(column), f32(row)) + within) / f32(EMISSION_CELLS);
}

// The cell of a pair of numbers.
fn emission_cell_at(u: vec2f) -> u32 {
    let at = min(vec2u(u * f32(EMISSION_CELLS)), vec2u(EMISSION_CELLS - 1u));
    return at.x * EMISSION_CELLS + at.y;
}

// How many times as densely a table places pairs in a cell as if they were spread evenly.
fn emission_guidance(light: u32, cell: u32) -> f32 {
    let share = emission_share(light, cell / EMISSION_CELLS, cell % EMISSION_CELLS);
    return f32(EMISSION_CELLS * EMISSION_CELLS) * share.x * share.y;
}

// Sums of shares up to the column and to the row.
fn emission_before(light: u32, column: u32, row: u32) -> vec2f {
    var before = vec2f(0.0);
    if column > 0u {
        before.x = emission_tables[light].columns[column - 1u];
    }
    if row > 0u {
        before.y = emission_tables[light].rows[column * EMISSION_CELLS + row - 1u];
    }
    return before;
}

// Share of the column, and of the row in it.
fn emission_share(light: u32, column: u32, row: u32) -> vec2f {
    let ends = vec2f(emission_tables[light].columns[column], emission_tables[light].rows[column * EMISSION_CELLS + row]);
    return ends - emission_before(light, column, row);
}

// A little below 1: no sum with a column's number is rounded up.
const EMISSION_BELOW_ONE: f32 = 1.0 - 0x1p-18;
