//! Work on all cores.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// How many threads work at once.
pub fn threads() -> usize {
    // Asking the system reads files.
    static THREADS: OnceLock<usize> = OnceLock::new();
    *THREADS.get_or_init(|| std::thread::available_parallelism().map_or(1, usize::from))
}

/// `work` of each number, begun in the order given; results in the order of the numbers. A panic in one is passed on.
pub fn each<T: Send>(numbers: impl IntoIterator<Item = usize>, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let numbers: Vec<usize> = numbers.into_iter().collect();
    let next = AtomicUsize::new(0);
    let run = || {
        let mut done = vec![];
        while let Some(number) = numbers.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.push((*number, work(*number)));
        }
        done
    };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads().min(numbers.len())).map(|_| scope.spawn(run)).collect();
        let mut done = run();
        for other in others {
            match other.join() {
                Ok(more) => done.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_numbers() {
        assert_eq!(each((0..100).rev(), |i| i * i), (0..100).map(|i| i * i).collect::<Vec<_>>());
        assert!(each([], |i| i).is_empty());
    }
}
