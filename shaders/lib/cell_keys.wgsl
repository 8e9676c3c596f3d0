//! Keys find their places: to be bound while keys come in. A place takes the greatest of the keys that ask for it, and
//! a key that is turned away asks for the next: whoever asks first, all end up alike (Gale and Shapley, 1962).
#define_import_path lightgraph::cell_keys
#import lightgraph::cells::{PLACES, TRIES, first_place, steps_to}

var<storage, read_write> new_keys: array<atomic<u32>>;

fn insert(key: u32) {
    var asking = key;
    var place = first_place(key);
    loop {
        let held = atomicMax(&new_keys[place], asking);
        if held == 0u || held == asking {
            return;
        }
        asking = min(held, asking);
        place = (place + 1u) % PLACES;
        if steps_to(asking, place) >= TRIES {
            return;
        }
    }
}
