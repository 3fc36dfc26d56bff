// Where paths go on to from diffuse surfaces: for each table the share of them that goes by each cell. The file that uses it binds
// `reflection_tables`.

struct ReflectionTable {
    // Sums of shares up to the end of each column of cells
    columns: array<f32, REFLECTION_CELLS>,
    // And, column by column, up to the end of each of its cells, as parts of the column's share
    rows: array<f32, REFLECTION_CELL_TOTAL>,
}

// Takes an evenly spread pair of numbers to one that is spread as a table says. Neighbours stay neighbours.
fn reflection_place(table: u32, u: vec2f) -> vec2f {
    var column = 0u;
    while column + 1u < REFLECTION_CELLS && u.x >= reflection_tables[table].columns[column] {
        column++;
    }
    let first = column * REFLECTION_CELLS;
    var row = 0u;
    while row + 1u < REFLECTION_CELLS && u.y >= reflection_tables[table].rows[first + row] {
        row++;
    }
    let before = reflection_before(table, column, row);
    let share = reflection_share(table, column, row);
    let within = clamp((u - before) / share, vec2f(0.0), vec2f(REFLECTION_BELOW_ONE));
    return (vec2f(f32(column), f32(row)) + within) / f32(REFLECTION_CELLS);
}

// How many times as densely a table places pairs in a cell as if they were spread evenly.
fn reflection_guidance(table: u32, cell: u32) -> f32 {
    let share = reflection_share(table, cell / REFLECTION_CELLS, cell % REFLECTION_CELLS);
    return f32(REFLECTION_CELLS * REFLECTION_CELLS) * share.x * share.y;
}

// Sums of shares up to the column and to the row.
fn reflection_before(table: u32, column: u32, row: u32) -> vec2f {
    var before = vec2f(0.0);
    if column > 0u {
        before.x = reflection_tables[table].columns[column - 1u];
    }
    if row > 0u {
        before.y = reflection_tables[table].rows[column * REFLECTION_CELLS + row - 1u];
    }
    return before;
}

// Share of the column, and of the row in it.
fn reflection_share(table: u32, column: u32, row: u32) -> vec2f {
    let ends = vec2f(reflection_tables[table].columns[column], reflection_tables[table].rows[column * REFLECTION_CELLS + row]);
    return ends - reflection_before(table, column, row);
}

// A little below 1: no sum with a column's number is rounded up.
const REFLECTION_BELOW_ONE: f32 = 1.0 - 0x1p-18;
