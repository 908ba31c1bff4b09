//! Memory that the files of a run share: the next one is read while another is rendered only if there is room for both.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Bytes for everything that is under way.
#[derive(Debug)]
pub(super) struct Budget {
    limit: u64,
    used: Mutex<u64>,
    freed: Condvar,
}

/// Bytes set aside until it is dropped.
#[derive(Debug)]
pub(super) struct Grant {
    budget: Arc<Budget>,
    bytes: u64,
}

/// How often who waits asks whether the run is to end.
const POLL: Duration = Duration::from_millis(50);

impl Budget {
    /// A budget of `limit` bytes.
    pub fn new(limit: u64) -> Arc<Self> {
        Arc::new(Self { limit, used: Mutex::new(0), freed: Condvar::new() })
    }

    /// Sets `bytes` aside as soon as there is room beside what others hold. What no one else is beside gets them in any
    /// case: whether one file alone fits is for who estimates to say. `None` when `stop` was set first.
    pub fn grant(self: &Arc<Self>, bytes: u64, stop: &AtomicBool) -> Option<Grant> {
        let mut grant = Grant { budget: Arc::clone(self), bytes: 0 };
        grant.resize(bytes, stop).then_some(grant)
    }

    fn used(&self) -> MutexGuard<'_, u64> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Grant {
    /// Makes it `bytes`, as soon as there is room beside what others hold. False when `stop` was set first.
    pub fn resize(&mut self, bytes: u64, stop: &AtomicBool) -> bool {
        let budget = Arc::clone(&self.budget);
        let mut used = budget.used();
        loop {
            if stop.load(Ordering::Relaxed) {
                return false;
            }
            let others = *used - self.bytes;
            if bytes <= self.bytes || others == 0 || others.saturating_add(bytes) <= budget.limit {
                *used = others.saturating_add(bytes);
                self.bytes = bytes;
                drop(used);
                budget.freed.notify_all();
                return true;
            }
            used = budget.freed.wait_timeout(used, POLL).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl Drop for Grant {
    fn drop(&mut self) {
        *self.budget.used() -= self.bytes;
        self.budget.freed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static GO: AtomicBool = AtomicBool::new(false);

    #[test]
    fn one_alone_gets_what_it_asks_for_and_the_next_waits_for_room() {
        let budget = Budget::new(100);
        let mut first = budget.grant(1000, &GO).unwrap();
        let waiting = {
            let budget = Arc::clone(&budget);
            std::thread::spawn(move || budget.grant(60, &GO).unwrap().bytes)
        };
        std::thread::sleep(Duration::from_millis(30));
        assert!(!waiting.is_finished());
        assert!(first.resize(40, &GO));
        assert_eq!(waiting.join().unwrap(), 60);
        assert_eq!(*budget.used(), 40);
        drop(first);
        assert_eq!(*budget.used(), 0);
    }

    #[test]
    fn who_waits_is_told_when_the_run_ends() {
        let budget = Budget::new(100);
        let _first = budget.grant(90, &GO).unwrap();
        let stop = AtomicBool::new(true);
        assert!(budget.grant(20, &stop).is_none());
        assert_eq!(*budget.used(), 90);
    }
}
