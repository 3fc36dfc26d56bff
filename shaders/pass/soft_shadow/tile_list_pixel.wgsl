// Which pixel an invocation over the list of tiles has. The module brings `list`.

// Beyond the image where there is none.
fn tile_list_pixel(group: vec3u, groups: vec3u, local: vec3u) -> vec2u {
    let index = group.y * groups.x + group.x;
    if index >= list.count {
        return vec2u(0xffffffffu);
    }
    let columns = tile_counts().x;
    let tile = list.tiles[index];
    return 8u * vec2u(tile % columns, tile / columns) + local.xy;
}
