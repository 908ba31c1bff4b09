//! CPU time of the calling thread.
//!
//! Wall time on a shared machine swings by a factor of 2 to 3; the time a thread was on a core does not. It is asked of
//! `clock_gettime`, exact to the nanosecond: the sums in `/proc` are only brought up to date at the kernel's ticks.

use std::time::Instant;

/// What `Clock` measures here: `thread CPU`, or `wall` where the system tells no thread's CPU time.
pub const KIND: &str = if cfg!(unix) { "thread CPU" } else { "wall" };

/// A moment of the calling thread. Only to be read by the thread that made it.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    wall: Instant,
    cpu: f64,
}

impl Clock {
    /// Now.
    pub fn start() -> Self {
        Self { wall: Instant::now(), cpu: cpu_seconds() }
    }

    /// Seconds since the start: of CPU time (see [`KIND`]) and of wall time.
    pub fn elapsed(&self) -> (f64, f64) {
        let cpu = cpu_seconds();
        let wall = self.wall.elapsed().as_secs_f64();
        (if cfg!(unix) { cpu - self.cpu } else { wall }, wall)
    }
}

#[cfg(unix)]
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn cpu_seconds() -> f64 {
    0.0
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn sleep_is_no_cpu_time_and_work_is() {
        let clock = Clock::start();
        std::thread::sleep(Duration::from_millis(60));
        let (cpu, wall) = clock.elapsed();
        assert!(wall >= 0.06 && cpu < 0.03, "{cpu} s of {wall} s");
        let clock = Clock::start();
        while clock.elapsed().0 < 0.01 {}
        assert!(clock.elapsed().1 >= 0.01);
    }
}
