//! Cells by their keys.
#define_import_path lightgraph::find_cell
#import lightgraph::cells::{PLACES, TRIES, NO_CELL, LARGE, first_place, key_beside}

/// By place in the table: its key, 0 for none, and the number of the cell.
var<storage, read> numbered: array<vec2u>;

/// The cell of a key; NO_CELL where there is none.
fn find(key: u32) -> u32 {
    var place = first_place(key);
    for (var i = 0u; i < TRIES; i++) {
        let held = numbered[place];
        if held.x == key {
            return held.y;
        }
        if held.x < key {
            break;
        }
        place = (place + 1u) % PLACES;
    }
    return NO_CELL;
}

/// The cell that holds a surface, or else one beside it on the same side, or else a large one.
fn find_near(position: vec3f, normal: vec3f) -> u32 {
    var cell = find_beside(position, normal, 0);
    if cell == NO_CELL {
        cell = find_beside(position, normal, LARGE);
    }
    return cell;
}

fn find_beside(position: vec3f, normal: vec3f, larger: i32) -> u32 {
    var cell = find(key_beside(position, normal, vec3i(0), larger));
    let size = abs(normal);
    let axis = select(2u, select(1u, 0u, size.x >= size.y), max(size.x, size.y) >= size.z);
    for (var i = 0u; i < 4u && cell == NO_CELL; i++) {
        var steps = vec3i(0);
        steps[(axis + 1u + i / 2u) % 3u] = select(-1, 1, i % 2u == 0u);
        cell = find(key_beside(position, normal, steps, larger));
    }
    return cell;
}
