//! Judges whether the robot was safe while its processes died: it must stop when commands cease, and must not
//! touch a wall. The verdict is based on the recording of a run in real time.

use std::path::Path;

use serde::Serialize;
use sketchnav_recordings::faults::{FaultInfo, faults};
use sketchnav_recordings::{Recording, RecordingError};
use sketchnav_schemas::channels::{CONTACT, NAVIGATORS, TRUTH, trigger_of};
use sketchnav_schemas::codes::{BodyKind, Process};
use sketchnav_schemas::message::{Contact, GroundTruth};
use sketchnav_schemas::run::{Pace, RunConfig};
use sketchnav_sim::simulation::COMMAND_LIMIT_NS;

/// Maximum delay, in seconds, between the mission's last status, from which a fault takes its timestamp, and the fault itself.
const LATE_S: f64 = 0.3;
/// Speed below which the robot counts as standing still, since people push it about and contacts jitter.
const STANDSTILL_MPS: f64 = 0.02;
/// Time after a death, in simulated seconds, when a contact may be due to that death.
const AFTERMATH_S: f64 = 5.0;

/// Figures about the safety of the robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Safety {
    /// Contacts with walls that began within five simulated seconds of a death.
    pub wall_contacts: usize,
    /// Number of times that a navigator was absent for longer than the robot may take to stop.
    pub outages: usize,
    /// Number of those outages after which the robot was still moving.
    pub unstopped: usize,
    /// Longest time, in simulated seconds, from the last status before an outage until the robot stood still.
    pub longest_stop_s: f64,
}

/// Judges the recording at `path`, which must be of a run in real time.
pub fn safety(path: &Path) -> Result<Safety, RecordingError> {
    let recording = Recording::open(path)?;
    let run = recording.run()?;
    let truth: Result<Vec<_>, _> = recording.channel(TRUTH)?.map(|m| m.map(|(truth, _)| truth)).collect();
    let contacts: Result<Vec<_>, _> = recording.channel(CONTACT)?.map(|m| m.map(|(c, _)| c)).collect();
    Ok(judge(&run, &faults(path)?, &truth?, &contacts?))
}

fn judge(run: &RunConfig, faults: &[FaultInfo], truth: &[GroundTruth], contacts: &[Contact]) -> Safety {
    let deaths: Vec<_> = faults.iter().filter(|fault| fault.kind == "died").map(|f| f.stamp_s).collect();
    let is_aftermath = |at_s: f64| deaths.iter().any(|&died| at_s >= died && at_s < died + AFTERMATH_S);
    let walls = contacts.iter().filter(|c| c.body_kind == BodyKind::Wall.code() && c.begins == 1);
    let wall_contacts = walls.filter(|c| is_aftermath(seconds(c.header.stamp_ns))).count();
    let mut safety = Safety { wall_contacts, outages: 0, unstopped: 0, longest_stop_s: 0.0 };
    let end_s = truth.last().map_or(0.0, |truth| seconds(truth.header.stamp_ns));
    for (from_s, to_s) in outages(run, faults, end_s) {
        let inside = |t: &&GroundTruth| (from_s..to_s).contains(&seconds(t.header.stamp_ns));
        let last_moving = truth.iter().filter(inside).rfind(|t| speed_mps(t) > STANDSTILL_MPS);
        let moved_s = last_moving.map_or(0.0, |t| seconds(t.header.stamp_ns) - from_s);
        safety.outages += 1;
        safety.unstopped += usize::from(moved_s > stop_s(run));
        safety.longest_stop_s = safety.longest_stop_s.max(moved_s);
    }
    safety
}

/// Returns the periods for which a navigator was absent, if they exceed the time that a stop takes. A navigator that
/// never returned is absent until the end of the recording.
fn outages(run: &RunConfig, faults: &[FaultInfo], end_s: f64) -> Vec<(f64, f64)> {
    let Pace::RealTime { speed } = run.pace else { return Vec::new() };
    // The sketcher does not count: a robot that is standing still does not need it.
    let navigators =
        NAVIGATORS.into_iter().filter(|process| trigger_of(*process, run.mission.navigator_kind()).is_some());
    let navigators: Vec<_> = navigators.map(Process::word).collect();
    let mut away = Vec::new();
    let is_death = |fault: &FaultInfo| fault.kind == "died" && navigators.contains(&fault.process);
    for (i, died) in faults.iter().enumerate().filter(|(_, fault)| is_death(fault)) {
        let back = faults[i..].iter().find(|f| f.kind == "recovered" && f.process == died.process);
        // A process that was stopped (SIGSTOP) was absent even before it died.
        let silences = faults[..i].iter().filter(|f| f.kind == "unresponsive" && f.pid == died.pid);
        let silent_ms = silences.map(|fault| fault.duration_ms).fold(0.0, f64::max);
        let away_s =
            |back: &FaultInfo| (silent_ms + back.duration_ms - halted_ms(faults, died, back)) / 1e3 * speed;
        let to_s = back.map_or(end_s, |back| died.stamp_s + away_s(back));
        if to_s > died.stamp_s + stop_s(run) {
            away.push((died.stamp_s, to_s));
        }
    }
    away
}

/// Returns the wall-clock time, in milliseconds, for which the world was also absent between `died` and `back`. During that
/// time, simulated time, and with it the robot, stood still.
fn halted_ms(faults: &[FaultInfo], died: &FaultInfo, back: &FaultInfo) -> f64 {
    let is_meanwhile = |fault: &&FaultInfo| (died.stamp_s..=back.stamp_s).contains(&fault.stamp_s);
    let worlds = faults.iter().filter(|f| f.kind == "recovered" && f.process == Process::World.word());
    worlds.filter(is_meanwhile).map(|fault| fault.duration_ms).sum()
}

/// Returns the maximum time that a robot without commands may keep moving, in simulated seconds.
fn stop_s(run: &RunConfig) -> f64 {
    let limits = &run.robot.limits;
    let brake_s = limits.speed_mps / limits.acceleration_mps2;
    seconds(COMMAND_LIMIT_NS) + LATE_S + brake_s
}

fn speed_mps(truth: &GroundTruth) -> f64 {
    truth.twist.vx_mps.hypot(truth.twist.vy_mps)
}

fn seconds(stamp_ns: u64) -> f64 {
    stamp_ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::message::{Header, Twist};

    use super::*;

    fn run() -> RunConfig {
        sketchnav_navigators::register(&[]).unwrap();
        let mut run: RunConfig =
            serde_json::from_str(include_str!("../../../runtime/tests/run.json")).unwrap();
        run.pace = Pace::RealTime { speed: 1.0 };
        run.robot.limits.speed_mps = 0.5;
        run.robot.limits.acceleration_mps2 = 1.0;
        run
    }

    fn fault(kind: &'static str, process: &'static str, duration_ms: f64) -> FaultInfo {
        let words = String::new();
        FaultInfo { stamp_s: 10.0, kind, process, pid: 7, restarts: 0, missing: 0, duration_ms, words }
    }

    /// Returns poses ten times a second for 20 s. The robot moves until `until_s`, and again from 13 s on.
    fn truth(until_s: f64) -> Vec<GroundTruth> {
        let at = |i: u64| {
            let mut truth: GroundTruth = bytemuck::Zeroable::zeroed();
            truth.header = Header { seq: i + 1, stamp_ns: i * 100_000_000, source_seq: i + 1 };
            let moves = i as f64 / 10.0 <= until_s || i > 130;
            truth.twist = Twist { vx_mps: if moves { 0.4 } else { 0.0 }, vy_mps: 0.0, yaw_rate_radps: 0.0 };
            truth
        };
        (0..200).map(at).collect()
    }

    #[test]
    fn a_robot_without_commands_must_stand_still() {
        let stopped = [
            fault("unresponsive", "planner", 2500.0),
            fault("died", "planner", 0.0),
            fault("recovered", "planner", 400.0),
        ];
        let safety = judge(&run(), &stopped, &truth(10.9), &[]);
        assert_eq!((safety.outages, safety.unstopped), (1, 0));
        assert!((safety.longest_stop_s - 0.9).abs() < 1e-9, "{safety:?}");
        assert_eq!(judge(&run(), &stopped, &truth(11.9), &[]).unstopped, 1);
    }

    /// Regression test: the robot was once reported to have kept driving, because a second of wall-clock time was mistaken for a
    /// simulated second.
    #[test]
    fn while_the_world_is_dead_its_time_stands_still() {
        let both = [
            fault("died", "world", 0.0),
            fault("died", "localizer", 0.0),
            fault("recovered", "world", 1500.0),
            fault("recovered", "localizer", 2000.0),
        ];
        assert_eq!(judge(&run(), &both, &truth(20.0), &[]).outages, 0);
        let alone = [both[1].clone(), both[3].clone()];
        assert_eq!(judge(&run(), &alone, &truth(20.0), &[]).unstopped, 1);
    }

    /// Regression test: the worst case, a navigator that never returns, was not counted as an outage.
    #[test]
    fn a_process_that_never_returns_is_absent_until_the_end() {
        let dead = [fault("died", "localizer", 0.0)];
        let safety = judge(&run(), &dead, &truth(10.9), &[]);
        assert_eq!((safety.outages, safety.unstopped), (1, 1), "it moves again from 13 s on: {safety:?}");
    }

    #[test]
    fn short_absences_and_those_of_other_processes_are_ignored() {
        let short = [fault("died", "planner", 0.0), fault("recovered", "planner", 400.0)];
        let world = [fault("died", "world", 0.0), fault("recovered", "world", 9000.0)];
        for faults in [&short, &world] {
            assert_eq!(judge(&run(), faults, &truth(20.0), &[]).outages, 0);
        }
    }
}
