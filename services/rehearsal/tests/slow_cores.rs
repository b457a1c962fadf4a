//! While a core needs longer than a scan period, the world carries on with the previous command.

use std::path::Path;

use sketchnav_rehearsal::{Onlooker, Rehearsal, Tap};
use sketchnav_schemas::channels::ChannelSpec;
use sketchnav_schemas::message::{GroundTruth, Message, VelocityCommand};
use sketchnav_schemas::run::RunConfig;

const STEPS: usize = 60;

#[derive(Default)]
struct Log {
    truth: Vec<GroundTruth>,
    command: Vec<VelocityCommand>,
}

impl Tap for Log {
    fn see(&mut self, spec: &'static ChannelSpec, bytes: &[u8], _cells: &[u8]) {
        match spec.name {
            "truth" => self.truth.push(*bytemuck::from_bytes(bytes)),
            "command" => self.command.push(*bytemuck::from_bytes(bytes)),
            _ => {}
        }
    }
}

impl Onlooker for Log {
    fn has_enough(&self) -> bool {
        self.command.len() >= STEPS
    }
}

fn driven(thinking_scans: u32) -> Log {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../sim/missions/laboratory/laboratory-a.toml");
    let (mission, robot) = sketchnav_sim::mission_file::load(&path).unwrap();
    let run = RunConfig::lockstep("rehearsal", mission, robot, 1);
    let mut log = Log::default();
    Rehearsal::new(&run).unwrap().thinking_for(thinking_scans).run(&mut log).unwrap();
    log
}

/// Returns the index of the first truth message with a moving robot.
fn begins_to_move(log: &Log) -> usize {
    log.truth.iter().position(|truth| truth.twist.vx_mps.hypot(truth.twist.vy_mps) > 0.01).unwrap()
}

#[test]
fn every_third_scan_is_answered_three_scans_late() {
    let [prompt, late] = [0, 3].map(driven);
    assert_eq!((prompt.command.len(), late.command.len()), (STEPS, STEPS));
    for (i, command) in late.command.iter().enumerate() {
        assert_eq!(command.header.source_seq as usize, 3 * i + 1);
    }
    for (i, truth) in late.truth.iter().enumerate() {
        assert_eq!(truth.header().seq as usize, i + 1, "none is left out");
    }
    let first =
        |log: &Log| log.command.iter().position(|c| c.twist.vx_mps.hypot(c.twist.vy_mps) > 0.0).unwrap();
    // A command takes effect one step later, and a late command is sent three steps after its scan.
    assert_eq!(begins_to_move(&prompt), first(&prompt) + 1);
    assert_eq!(begins_to_move(&late), 3 * (first(&late) + 1) + 1);
}
