//! How a radix sort divides keys: in blocks, by digits of four bits.
#define_import_path lists::digits

/// Keys of a block.
const BLOCK: u32 = 1024u;
const DIGITS: u32 = 16u;

/// Digit number `digit` of a key, from the lowest.
fn digit_of(key: u32, digit: u32) -> u32 {
    return (key >> (4u * digit)) % DIGITS;
}
