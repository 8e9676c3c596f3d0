//! Graphs side by side: shaders are compiled on one core each, so that one graph after the other would leave the others
//! idle.

use super::report::{CaseRow, CaseRows};
use lightgraph::{Checked, Faults, Gpu};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

/// More would compete for the device, and each has its own memory.
const MOST: usize = 4;

/// What a turn does: with a device of the lane's own, its number, its share of the time that is left, and whom to give
/// its rows to.
pub(super) type Turn<'t> = dyn Fn(&Gpu, usize, f64, &mut dyn FnMut(Vec<CaseRow>)) -> Checked<()> + Sync + 't;

/// How many turns are taken at once.
fn count(turns: usize) -> usize {
    std::thread::available_parallelism().map_or(1, usize::from).min(MOST).min(turns)
}

/// Takes so many turns. Rows are told when they are known, and returned in the order of the turns.
///
/// # Errors
/// Those of the turns, and no further device; all of them.
pub(super) fn turns(gpu: &Gpu, number: usize, rows: &mut CaseRows<'_>, turn: &Turn<'_>) -> Checked<Vec<CaseRow>> {
    let lanes = count(number);
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..lanes {
            let (send, next) = (send.clone(), &next);
            scope.spawn(move || {
                // Nobody listens when the caller has gone; then nothing is left to tell.
                let fail = |faults: Faults| drop(send.send((0, Err(faults))));
                let own = match Gpu::open_named(Some(&gpu.info.name)) {
                    Ok(own) => own,
                    Err(e) => return fail(e.into()),
                };
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    if i >= number {
                        break;
                    }
                    // All that are left share the time, as many at once as there are lanes.
                    let share = 1.0 / (number - i).div_ceil(lanes) as f64;
                    let mut keep = |rows| drop(send.send((i, Ok(rows))));
                    if let Err(faults) = turn(&own, i, share, &mut keep).and_then(|()| own.check()) {
                        fail(faults);
                    }
                }
            });
        }
        drop(send);
        let mut found: Vec<Vec<CaseRow>> = vec![vec![]; number];
        let mut faults = vec![];
        for (i, result) in receive {
            match result {
                Ok(new) => {
                    rows.tell(&new);
                    found[i].extend(new);
                }
                Err(more) => faults.extend(more.0),
            }
        }
        Faults::check(faults, found.concat())
    })
}
