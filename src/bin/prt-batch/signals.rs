//! SIGINT, SIGTERM and SIGHUP end a run cleanly; a second SIGINT or SIGTERM ends the process at once.

use crate::term;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::iterator::Signals;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::time::Duration;

/// What the process ends with when it is interrupted.
const INTERRUPTED: i32 = 75;

/// A signal so soon after the first is the same one: `timeout`, for one, sends it to the process and then to its group.
const SAME: Duration = Duration::from_millis(300);

/// From now on `cancel` is set by the first signal.
///
/// # Errors
/// The system refuses handlers or a thread; signals then end the process as usual.
pub fn install(cancel: &Arc<AtomicBool>) -> io::Result<()> {
    // What was ignored when the process started stays so: `nohup` ignores SIGHUP, a shell's `&` SIGINT.
    let ignored = std::fs::read_to_string("/proc/self/status").ok().and_then(|status| ignored_by(&status)).unwrap_or(0);
    let wanted: Vec<_> =
        [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0).collect();
    let is_armed = Arc::new(AtomicBool::new(false));
    for &signal in &wanted {
        if signal != SIGHUP {
            flag::register_conditional_shutdown(signal, INTERRUPTED, Arc::clone(&is_armed))?;
        }
        // Set by the handler itself, so that no thread can come too late to it.
        flag::register(signal, Arc::clone(cancel))?;
    }
    let mut signals = Signals::new(&wanted)?;
    let wait = move || {
        if signals.forever().next().is_some() {
            // A terminal that takes no text must not keep the second signal from ending the process.
            let say = || term::interrupted("finishing what is being written; press again to stop at once");
            let _ = std::thread::Builder::new().spawn(say);
            std::thread::sleep(SAME);
            is_armed.store(true, SeqCst);
        }
    };
    std::thread::Builder::new().name("signals".into()).spawn(wait).map(drop)
}

/// The mask of ignored signals, bit n - 1 for signal n, in the text of `/proc/self/status`.
fn ignored_by(status: &str) -> Option<u64> {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(mask.trim(), 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_the_system_s_mask() {
        assert_eq!(ignored_by("Name:\tx\nSigIgn:\t0000000000001001\nSigCgt:\t0\n"), Some(0x1001));
        assert_eq!(ignored_by("Name:\tx\n"), None);
    }
}
