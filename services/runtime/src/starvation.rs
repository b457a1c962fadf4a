//! Starves this process of the processor: for some time, it only gets a share of it, as on a machine with too few cores.
//!
//! To do this, the process repeatedly stops itself (SIGSTOP). This requires neither root nor control groups,
//! takes nothing away from other processes, and gives the same share on every machine. A process that
//! competes for the cores would have none of these advantages.
//!
//! Before each stop, a kernel timer is set that continues the process (SIGCONT). No other process is needed
//! for that, so the process is continued no matter what else is killed in the meantime.

use std::thread;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::sys::signal::{SigEvent, SigevNotify, Signal, raise};
use nix::sys::time::TimeSpec;
use nix::sys::timer::{Expiration, Timer, TimerSetTimeFlags};
use nix::time::ClockId;
use sketchnav_schemas::fault_plan::Starvation;

/// In each period, the process runs for its share and is stopped for the rest. The period is as long as the time slices of a
/// busy scheduler, and shorter than the time without commands after which a robot stops.
const PERIOD: Duration = Duration::from_millis(100);
/// Delays, counted from the end of a stop, after which the process is continued. On a busy machine, the stop itself may be delayed
/// until after the first timer, which then has no effect.
const BACKUPS: [Duration; 3] = [Duration::ZERO, Duration::from_secs(1), Duration::from_secs(30)];

/// Starves this process: stops it for the first time immediately, and continues in a separate thread.
///
/// # Errors
/// If the kernel has no timer or no thread left, in which case the process is not stopped.
pub(crate) fn starve(starvation: Starvation) -> Result<(), Errno> {
    let end = Instant::now() + Duration::from_millis(starvation.duration_ms);
    let run = PERIOD.mul_f64(starvation.share);
    let stop = move || {
        let left = end.saturating_duration_since(Instant::now());
        stop_for((PERIOD - run).min(left)).map(|()| end > Instant::now())
    };
    if stop()? {
        let stop_repeatedly = move || {
            loop {
                // This sleep is the share, in which the other threads of the process run.
                thread::sleep(run);
                // Without timers, starvation ends here, because a stop would never end.
                if !stop().unwrap_or(false) {
                    return;
                }
            }
        };
        let started = thread::Builder::new().name("starvation".to_owned()).spawn(stop_repeatedly);
        started.map_err(|error| error.raw_os_error().map_or(Errno::EAGAIN, Errno::from_raw))?;
    }
    Ok(())
}

/// Stops this process with all its threads for the given time.
fn stop_for(pause: Duration) -> Result<(), Errno> {
    if pause.is_zero() {
        return Ok(());
    }
    let mut timers = Vec::with_capacity(BACKUPS.len());
    for backup in BACKUPS {
        let event = SigEvent::new(SigevNotify::SigevSignal { signal: Signal::SIGCONT, si_value: 0 });
        let mut timer = Timer::new(ClockId::CLOCK_MONOTONIC, event)?;
        let expiration = Expiration::OneShot(TimeSpec::from_duration(pause + backup));
        timer.set(expiration, TimerSetTimeFlags::empty())?;
        timers.push(timer);
    }
    raise(Signal::SIGSTOP)
}
