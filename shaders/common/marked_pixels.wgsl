// Pixels that are to be estimated anew, a bit each: by blocks of 8 x 8, two words a block, row by row. Twin of `MarkedPixels`.

// Blocks along both axes.
fn marked_blocks(size: vec2u) -> vec2u {
    return (size + 7u) / 8u;
}

// The first of a block's two words.
fn marked_word(block: vec2u, blocks: vec2u) -> u32 {
    return 2u * (block.y * blocks.x + block.x);
}
