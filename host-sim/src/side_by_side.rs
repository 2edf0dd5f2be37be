//! Pieces of work side by side, their results in order.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// How many pieces run at once unless told: one for each core, since a
/// diagnosis on one thread costs less work in all than on two that wait for
/// each other.
pub fn usual() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

/// Runs `items`, `at_once` of them at a time, and hands the results over in the
/// order of the items. The cores are shared out: what an item does in parallel
/// it does on its share of them.
///
/// # Errors
/// The first that `take` gives; items that run end, others are not begun.
pub fn side_by_side<T, R, E>(
    items: &[T],
    at_once: NonZeroUsize,
    run: impl Fn(&T) -> R + Sync,
    mut take: impl FnMut(R) -> Result<(), E>,
) -> Result<(), E>
where
    T: Sync,
    R: Send,
{
    let threads = (usual().get() / at_once).max(1);
    let next = AtomicUsize::new(0);
    let work = |results: mpsc::Sender<(usize, R)>| {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(number) else { break };
            if results.send((number, run(item))).is_err() {
                break;
            }
        }
    };
    thread::scope(|scope| {
        let (sender, results) = mpsc::channel();
        for _ in 0..at_once.get() {
            let (sender, work) = (sender.clone(), &work);
            scope.spawn(move || on_threads(threads, || work(sender)));
        }
        drop(sender);
        let mut early = BTreeMap::new();
        let mut due = 0;
        for (number, result) in results {
            early.insert(number, result);
            while let Some(result) = early.remove(&due) {
                take(result)?;
                due += 1;
            }
        }
        Ok(())
    })
}

/// On threads of its own, or where none are to be had on those of all.
fn on_threads(threads: usize, work: impl FnOnce() + Send) {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const TWO: NonZeroUsize = NonZeroUsize::new(2).unwrap();

    #[test]
    fn prop_results_come_in_the_order_of_the_items() {
        let mut seen = Vec::new();
        let slow_first = |&item: &u64| {
            thread::sleep(Duration::from_millis(if item == 0 { 50 } else { 0 }));
            item
        };
        let taken = side_by_side(&[0, 1, 2, 3, 4], TWO, slow_first, |item| {
            seen.push(item);
            Ok::<(), ()>(())
        });
        assert_eq!((taken, seen), (Ok(()), vec![0, 1, 2, 3, 4]));
    }

    #[test]
    fn prop_an_error_ends_the_work() {
        let begun = AtomicUsize::new(0);
        let items = vec![0; 10_000];
        let count = |_: &i32| {
            thread::sleep(Duration::from_micros(100));
            begun.fetch_add(1, Ordering::Relaxed)
        };
        let ended = side_by_side(&items, TWO, count, |_| Err("full"));
        assert_eq!(ended, Err("full"));
        assert!(begun.into_inner() < items.len());
    }

    #[test]
    fn prop_an_item_has_its_share_of_the_threads() {
        let threads = |_: &()| rayon::current_num_threads();
        let share = (usual().get() / 2).max(1);
        let taken = side_by_side(&[()], TWO, threads, |threads| {
            if threads == share {
                Ok(())
            } else {
                Err(threads)
            }
        });
        assert_eq!(taken, Ok(()));
    }
}
