//! The sending side of a driver's channel.

use sketchnav_runtime::{Node, RawWriter};
use sketchnav_schemas::channels::{ChannelSpec, SCAN};
use sketchnav_schemas::erased::{self, Owned};
use sketchnav_schemas::message::{Header, LaserScan};
use sketchnav_schemas::valid::{Checked, ensure};

use crate::error::DriverError;

/// Maximum angle that the beams of a scan cover, in radians: a full turn and a tenth.
const MOST_TURN_RAD: f64 = 1.1 * std::f64::consts::TAU;

/// The sending side of a channel. It checks messages, and does not send more between two ticks than the channel's capacity.
///
/// If a sensor takes more readings than that, they are thinned evenly. The latest one is held back and sent just before the tick.
pub struct Outlet {
    writer: RawWriter,
    thinning: Thinning,
    /// Number of messages since the last tick.
    since_tick: usize,
    /// Timestamp of the latest message, in nanoseconds.
    newest_ns: Option<u64>,
    /// The latest reading, if it has been held back.
    held: Owned,
    /// Memory for the next reading to hold back.
    spare: Owned,
    is_holding: bool,
}

impl Outlet {
    /// Opens a channel, continuing after the last message of an earlier driver. `period_ns` is the tick
    /// period.
    pub fn open(node: &Node, spec: &'static ChannelSpec, period_ns: u64) -> Result<Self, DriverError> {
        let mut writer = node.raw_writer(spec)?;
        writer.resume_after_history();
        let newest_ns = writer.last_sent().map(|words| erased::header(bytemuck::cast_slice(&words)).stamp_ns);
        Ok(Self {
            writer,
            thinning: Thinning::new(period_ns, spec.per_tick),
            since_tick: 0,
            newest_ns,
            held: Owned::default(),
            spare: Owned::default(),
            is_holding: false,
        })
    }

    /// Returns the channel.
    pub fn spec(&self) -> &'static ChannelSpec {
        self.writer.spec()
    }

    /// Returns the last message that an earlier driver sent, as eight-byte words.
    pub fn last_sent(&self) -> Option<Vec<u64>> {
        self.writer.last_sent()
    }

    /// Returns the timestamp of the latest message, in nanoseconds.
    pub fn newest_ns(&self) -> Option<u64> {
        self.newest_ns
    }

    /// Sends a message, or holds it back. `source_seq` is the number of its tick.
    ///
    /// # Errors
    /// Any error of `fill`, and [`DriverError`] if the message is invalid, not later than the previous one, or more than the channel
    /// can take before the next tick. In any of these cases, it is not sent.
    pub fn send<E: From<DriverError>>(
        &mut self,
        (stamp_ns, source_seq): (u64, u64),
        fill: impl FnOnce(&mut [u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (spec, before_ns) = (self.spec(), self.newest_ns);
        let is_thinned = spec.is_sensed() && spec.per_tick > 1;
        if !is_thinned && self.since_tick == spec.per_tick {
            return Err(DriverError::TooMany { channel: spec.name, most: spec.per_tick }.into());
        }
        let header = Header { seq: 0, stamp_ns, source_seq };
        let takes = !is_thinned || self.thinning.takes(stamp_ns);
        if takes {
            let mut loan = self.writer.loan(0).map_err(DriverError::from)?;
            filled(spec, loan.parts_mut().0, (header, before_ns), fill)?;
            loan.send_quietly().map_err(DriverError::from)?;
        } else {
            // The held reading stays if this one turns out to be invalid.
            filled(spec, self.spare.blank(spec.message.size, 0).0, (header, before_ns), fill)?;
            std::mem::swap(&mut self.held, &mut self.spare);
        }
        self.thinning.count(stamp_ns, takes);
        self.is_holding = !takes;
        self.newest_ns = Some(stamp_ns);
        self.since_tick += 1;
        Ok(())
    }

    /// Sends the reading that was held back, before a tick.
    pub fn flush(&mut self) -> Result<(), DriverError> {
        if std::mem::take(&mut self.is_holding) {
            let mut loan = self.writer.loan(0)?;
            loan.parts_mut().0.copy_from_slice(self.held.bytes());
            loan.send_quietly()?;
        }
        self.thinning.ticked();
        self.since_tick = 0;
        Ok(())
    }
}

/// Fills a message and checks it, also against the timestamp of the one before.
fn filled<E: From<DriverError>>(
    spec: &ChannelSpec,
    message: &mut [u8],
    (header, before_ns): (Header, Option<u64>),
    fill: impl FnOnce(&mut [u8]) -> Result<(), E>,
) -> Result<(), E> {
    fill(message)?;
    *erased::header_mut(message) = header;
    let checked =
        spec.message.check(message).and_then(|()| SCAN.message(spec, message).map_or(Ok(()), check_turn));
    checked.map_err(|why| DriverError::Invalid { channel: spec.name, why })?;
    // Several events may happen at the same time.
    let (found_ns, earliest) = (header.stamp_ns, u64::from(spec.is_sensed()));
    match before_ns.filter(|before_ns| found_ns < before_ns + earliest) {
        Some(before_ns) => Err(DriverError::Stamp { channel: spec.name, before_ns, found_ns }.into()),
        None => Ok(()),
    }
}

/// Checks that the beams of a scan cover at most a full turn, with some slack for sensors that count one beam
/// too many. Readers accept more than that, since such a scan may have been recorded, but a driver that sends
/// one has mistaken degrees for radians.
fn check_turn(scan: &LaserScan) -> Checked {
    let step_rad = f64::from(scan.angle_increment_rad);
    let turn_rad = step_rad.abs() * f64::from(scan.beam_count.saturating_sub(1));
    let expected = "beams over at most a full turn, in radians";
    ensure(turn_rad <= MOST_TURN_RAD, "angle_increment_rad", expected, step_rad)
}

/// Selects which readings are sent, so that all readings between two ticks are available to a late reader.
#[derive(Debug)]
struct Thinning {
    gap_ns: u64,
    most: usize,
    /// Number of readings since the last tick, and how many of them were sent.
    found: usize,
    sent: usize,
    last_ns: Option<u64>,
    /// True if there were too many readings before the last tick.
    is_fast: bool,
}

impl Thinning {
    /// Creates a selection for ticks with a period of `period_ns` nanoseconds, and `per_tick` messages per tick.
    fn new(period_ns: u64, per_tick: usize) -> Self {
        let gap_ns = period_ns / per_tick.max(1) as u64;
        // One message per tick is reserved for the last reading before it.
        let most = per_tick.saturating_sub(1).max(1);
        Self { gap_ns, most, found: 0, sent: 0, last_ns: None, is_fast: false }
    }

    /// Returns true if a reading with the given timestamp should be sent now. (The last reading before a tick is sent in any case.)
    fn takes(&self, stamp_ns: u64) -> bool {
        let is_far = !self.is_fast || self.last_ns.is_none_or(|last| stamp_ns >= last + self.gap_ns);
        is_far && self.sent < self.most
    }

    /// Counts a reading, and whether it was sent.
    fn count(&mut self, stamp_ns: u64, was_sent: bool) {
        self.found += 1;
        if was_sent {
            (self.last_ns, self.sent) = (Some(stamp_ns), self.sent + 1);
        }
    }

    /// Records that a tick was sent.
    fn ticked(&mut self) {
        self.is_fast = self.found > self.most;
        (self.found, self.sent) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the timestamps of the readings that are sent immediately.
    fn sent(thinning: &mut Thinning, stamps: impl Iterator<Item = u64>) -> Vec<u64> {
        let takes = |stamp: &u64| {
            let takes = thinning.takes(*stamp);
            thinning.count(*stamp, takes);
            takes
        };
        stamps.filter(takes).collect()
    }

    #[test]
    fn fast_wheels_are_thinned_evenly_and_slow_ones_are_not_thinned() {
        let (period_ns, per_tick) = (100_000_000, 8);
        for (readings_hz, sent_a_tick, longest_gap_ns) in
            [(20, 2, 50_000_000), (50, 5, 20_000_000), (1000, 7, 13_000_000)]
        {
            let mut thinning = Thinning::new(period_ns, per_tick);
            for tick in 0..5 {
                let stamps =
                    (0..readings_hz / 10).map(|i| tick * period_ns + i * 1_000_000_000 / readings_hz);
                let sent = sent(&mut thinning, stamps);
                assert_eq!(sent.len(), sent_a_tick, "{readings_hz} Hz");
                // The rate of the odometry is known from the second tick on.
                let is_even = sent.windows(2).all(|pair| pair[1] - pair[0] <= longest_gap_ns);
                assert!(is_even || tick == 0, "{readings_hz} Hz: {sent:?}");
                thinning.ticked();
            }
        }
    }

    /// Readings that arrive in bursts do not exceed the capacity, so none is left out.
    #[test]
    fn late_readings_are_not_left_out() {
        let mut thinning = Thinning::new(100_000_000, 8);
        for tick in 0..5 {
            let stamps = (0..5).map(|i| tick * 100_000_000 + i);
            assert_eq!(sent(&mut thinning, stamps).len(), 5);
            thinning.ticked();
        }
    }
}
