// Irradiance at a point, estimated from the photons around it. The module brings `grid`, `splats` and `first_splats`.

alias Receivers = f32;
alias Surfaces = u32;

fn grid_light(receiver: Receiver) -> Gathered {
    var g = gathered_nothing(receiver);
    let cell = grid_cell(receiver.position);
    let first = max(cell - 1, vec3i(0));
    let last = min(cell + 1, vec3i(i32(grid.cells) - 1));
    for (var z = first.z; z <= last.z; z++) {
        for (var y = first.y; y <= last.y; y++) {
            // Those of a row of cells lie one behind the other.
            let start = first_splats[grid_index(vec3i(first.x, y, z))];
            gather_range(&g, start, first_splats[grid_index(vec3i(last.x, y, z)) + 1u]);
        }
    }
    return g;
}
