//! Where cells stand.
#define_import_path lightgraph::find_cell
#import lightgraph::cells::{PLACES, TRIES, NO_CELL, first_place}

var<storage, read> keys: array<u32>;

/// The place of a key; NO_CELL where there is none.
fn find(key: u32) -> u32 {
    var place = first_place(key);
    for (var i = 0u; i < TRIES; i++) {
        let held = keys[place];
        if held == key {
            return place;
        }
        if held < key {
            break;
        }
        place = (place + 1u) % PLACES;
    }
    return NO_CELL;
}
