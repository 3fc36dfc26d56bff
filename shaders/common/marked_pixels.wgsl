// Pixels that are to be estimated anew. Twin of `MarkedPixels`.

struct MarkedPixels {
    // Of a dispatch with an invocation for each
    workgroups: array<u32, 3>,
    count: u32,
    // Column in the lower half, row in the upper
    pixels: array<u32>,
}
