//! Panics as users see them: an error with its place, not the text of the language. `RUST_BACKTRACE=1` shows that.

use crate::term;
use prt::batch::panics::{message, remember};
use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook};
use std::process::ExitCode;

/// Runs the program. A panic that ends it is told as an error, with Rust's own exit code 101; one that ends only an
/// image is that image's error.
pub fn guarded(program: impl FnOnce() -> ExitCode) -> ExitCode {
    set_hook(Box::new(|info| {
        remember(info);
        let trace = Backtrace::capture();
        if trace.status() == BacktraceStatus::Captured {
            term::say_in_panic(&format!("{info}\n{trace}"));
        }
    }));
    catch_unwind(AssertUnwindSafe(program)).unwrap_or_else(|payload| {
        term::error(&message(&*payload));
        ExitCode::from(101)
    })
}
