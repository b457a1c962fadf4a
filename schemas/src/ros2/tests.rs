use bytemuck::Zeroable;

use super::*;
use crate::codes::{Code, FaultKind, Process};
use crate::message::*;

fn cdr<T: Ros2>(message: &T, cells: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    message.to_cdr(cells, &mut out).unwrap_or_else(|e| panic!("{}: {e}", T::NAME));
    out
}

/// A sequence length of four billion in thirty bytes must not make the reader reserve memory for it.
#[test]
fn a_wrong_length_does_not_read_beyond_the_end() {
    let scan = LaserScan { header: Header { seq: 1, stamp_ns: 0, source_seq: 1 }, ..Zeroable::zeroed() };
    let mut bytes = cdr(&scan, &[]);
    let ranges = bytes.len() - 8;
    bytes[ranges..ranges + 4].fill(0xff);
    assert!(matches!(LaserScan::from_cdr(&bytes, 1), Err(Ros2Error::Cdr(_))));
}

#[test]
fn values_that_would_not_round_trip_are_refused() {
    let mut out = Vec::new();
    let header = Header { seq: 3, stamp_ns: 5, source_seq: 3 };
    let scan = LaserScan { header, ..Zeroable::zeroed() };
    let tail = {
        let mut scan = scan;
        scan.ranges_m[9] = 1.0;
        scan
    };
    let stray_cause = LaserScan { header: Header { source_seq: 2, ..header }, ..scan };
    let too_many = LaserScan { beam_count: 1441, ..scan };
    let unnumbered = LaserScan { header: Header { seq: 0, source_seq: 0, ..header }, ..scan };
    let late = LaserScan { header: Header { stamp_ns: u64::MAX, ..header }, ..scan };
    for (bad, field) in [
        (tail, "ranges_m"),
        (stray_cause, "header.source_seq"),
        (too_many, "ranges_m"),
        (unnumbered, "header.seq"),
        (late, "header.stamp_ns"),
    ] {
        let error = bad.to_cdr(&[], &mut out).unwrap_err();
        assert!(matches!(error, Ros2Error::Value { field: f, .. } if f == field), "{error}");
    }
    assert!(scan.to_cdr(&[1], &mut out).is_err(), "a scan has no cells");
    let mut status: MissionStatus = Zeroable::zeroed();
    status.header = header;
    status.name.0[5] = b'x';
    assert!(matches!(status.to_cdr(&[], &mut out), Err(Ros2Error::Text { field: "name" })));
}

#[test]
fn a_foreign_frame_is_refused() {
    let header = Header { seq: 3, stamp_ns: 5, source_seq: 3 };
    let truth = GroundTruth { header, ..Zeroable::zeroed() };
    let error = Odometry::from_cdr(&cdr(&truth, &[]), 3).unwrap_err();
    assert!(matches!(error, Ros2Error::Foreign { .. }), "{error}");
}

/// Regression test: a driver that computes its quaternions leaves rounding errors in x and y, and −0 if it inverts them. Its
/// whole odometry was once rejected, with a byte offset as the reason.
#[test]
fn rounding_in_a_quaternion_is_distinguished_from_a_tilt() {
    let header = Header { seq: 3, stamp_ns: 5, source_seq: 3 };
    let level = PoseM { orientation_w: 1.0, ..Zeroable::zeroed() };
    let odometry = Odometry { header, pose: level, ..Zeroable::zeroed() };
    let exact = cdr(&odometry, &[]);
    let w = exact.windows(8).position(|bytes| bytes == 1.0_f64.to_le_bytes()).unwrap();
    let with = |x: f64, y: f64| {
        let mut bytes = exact.clone();
        bytes[w - 24..w - 16].copy_from_slice(&x.to_le_bytes());
        bytes[w - 16..w - 8].copy_from_slice(&y.to_le_bytes());
        Odometry::from_cdr(&bytes, 3).map(drop)
    };
    assert!(with(0.0, 0.0).is_ok());
    for (x, y) in [(-0.0, 0.0), (0.0, 1e-17), (1e-9, -1e-9)] {
        let Err(Ros2Error::Rounded { exact: again, .. }) = with(x, y) else { panic!("({x}, {y})") };
        assert_eq!(again, exact);
    }
    for (x, y, place) in [(0.25, 0.25, w - 24), (-0.0, 1e-8, w - 16), (f64::NAN, 0.0, w - 24)] {
        let Err(Ros2Error::NotZero { offset, .. }) = with(x, y) else { panic!("({x}, {y})") };
        assert_eq!(offset, place);
    }
    let error = with(0.25, 0.0).unwrap_err().to_string();
    assert!(
        error.ends_with("expected 0, as in a planar pose without tilt or covariance, found 0.25"),
        "{error}"
    );
}

/// Returns the number of times that the schema of `T` has a constant with the given name and number.
fn constants<T: Ros2>(name: &str, code: u32) -> usize {
    let line = format!("uint32 {}={code} #", definitions::constant(name));
    T::schema().lines().filter(|found| found.starts_with(&line)).count()
}

/// Regression test: the `.msg` texts were once written by hand. When `Process::Pad` was added to the code, it was forgotten in
/// the two messages that contain a process.
#[test]
fn the_pad_is_a_process_in_every_message_that_names_processes() {
    for value in Process::VALUES {
        assert_eq!(constants::<Health>(value.name, value.code), 1, "{value:?}");
        assert_eq!(constants::<Fault>(value.name, value.code), 1, "{value:?}");
    }
    assert_eq!(constants::<Health>("Pad", 8), 1);
    assert_eq!(constants::<Fault>("GivenUp", FaultKind::GivenUp.code()), 1);
}

#[test]
fn a_msg_looks_hand_written() {
    let text = "# The robot started or stopped touching something.
# Frame: world.
uint32 WALL=1 # A wall of the building.
uint32 FURNITURE=2 # Furniture, which no sketch shows.
uint32 PERSON=3 # A person who walks.

std_msgs/Header header
# Number of the message that caused this one.
uint64 source_seq
# Position of the contact, x and y.
geometry_msgs/Point position_m
# Largest impulse of the contact so far, N·s.
float64 impulse_ns
# What the robot touched.
uint32 body_kind
# 1: the contact begins, 0: it ends.
uint32 begins
";
    assert_eq!(Contact::definitions()[0].text, text);
}
