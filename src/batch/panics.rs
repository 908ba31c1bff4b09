//! Panics of one image become its error and stop no other.
//!
//! What a panic says comes with it, where it happened is known to the program's panic hook only: a program that wants
//! the place in error messages has its hook call [`remember`].

use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// Panics of which the place is remembered, the latest last.
const REMEMBERED: usize = 16;

static PLACES: Mutex<Vec<(String, String)>> = Mutex::new(Vec::new());

/// Remembers where a panic happened, for the message of the image that it ends.
pub fn remember(info: &PanicHookInfo<'_>) {
    let Some(place) = info.location() else { return };
    let mut places = PLACES.lock().unwrap_or_else(PoisonError::into_inner);
    if places.len() == REMEMBERED {
        places.remove(0);
    }
    places.push((text_of(info.payload()), format!("{}:{}", place.file(), place.line())));
}

/// What is said of a panic with this payload, such as `internal error: index 7 out of range (src/a.rs:12)`, and what
/// to do about it. The place is there if it was remembered.
pub fn message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = text_of(payload);
    let places = PLACES.lock().unwrap_or_else(PoisonError::into_inner);
    let place = places.iter().rev().find(|(known, _)| *known == text);
    let place = place.map_or(String::new(), |(_, place)| format!(" ({place})"));
    format!("internal error: {text}{place}\n  This is a bug in prt-batch, please report it with the file.")
}

fn text_of(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default()
}

/// Runs `work`; a panic in it becomes an error, so that the batch goes on.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| Err(message(&*payload)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error_that_says_what_and_where() {
        let error = guarded::<()>(|| panic!("index {} out of range", 7)).unwrap_err();
        assert!(error.starts_with("internal error: index 7 out of range\n"), "{error}");

        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            remember(info);
            before(info);
        }));
        let line = line!() + 1;
        let error = guarded::<()>(|| panic!("index {} out of range", 8)).unwrap_err();
        let told = format!("internal error: index 8 out of range (src/batch/panics.rs:{line})\n");
        assert!(error.starts_with(&told) && error.contains("bug"), "{error}");
        // Rayon carries a panic from the worker that had it to the one that waits.
        let error = guarded::<()>(|| rayon::join(|| panic!("index 9 out of range"), || ()).0).unwrap_err();
        assert!(error.contains("index 9 out of range (src/batch/panics.rs:"), "{error}");
    }
}
