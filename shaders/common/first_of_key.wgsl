// The module brings `keys`, sorted.

// Index of the first of `count` keys that is no lower than this one; `count` if there is none.
fn first_of_key(key: u32, count: u32) -> u32 {
    var low = 0u;
    var high = count;
    while low < high {
        let middle = (low + high) / 2u;
        if keys[middle] < key {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}
