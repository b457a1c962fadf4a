use std::io::{self, BufReader, Read};

use proptest::prelude::*;

use super::*;

const LOG: &str = "# a log\nPARAM robot_length 0.47\nODOM 0 0 0 0 0 0 0.1 h 0.1\nODOM 1 0 0 0 0 0 0.2 h 0.2\nFLASER 3 1.5 2.5 81.9 0.9 0.1 0 0.9 0.1 0 0.25 h 0.25\nODOM 0.9 0.1 0 0 0 0 0 h 0\nNEFF 4\nODOM 0.9 0.6 0 0 0 0 0.4 h 0.4\nFLASER 3 1 2 3 0.8 0.7 0.1 0.8 0.7 0.1 0.5 h 0.5\n";

fn entries(log: &[u8]) -> Vec<Entry> {
    let reading = Survey::of(log).unwrap().reading().unwrap();
    CarmenLog::new(log, reading).collect::<Result<_, _>>().unwrap()
}

/// Returns the scans and the lines that were left out.
fn read(log: impl AsRef<[u8]>) -> (Vec<CarmenScan>, Vec<LeftOut>) {
    let (mut scans, mut left_out) = (Vec::new(), Vec::new());
    for entry in entries(log.as_ref()) {
        match entry {
            Entry::Scan(scan) => scans.push(scan),
            Entry::LeftOut(line) => left_out.push(line),
        }
    }
    (scans, left_out)
}

/// Returns a scan of two readings, at `x` by the reference and at `own` by the robot's odometry.
fn flaser(x: f64, own: f64) -> String {
    format!("FLASER 2 1 2 {x} 0 0 {own} 0 0 {own} h 0\n")
}

fn odom(x: f64) -> String {
    format!("ODOM {x} 0 0 0 0 0 {x} h 0\n")
}

fn words(left_out: &[LeftOut]) -> Vec<String> {
    left_out.iter().map(LeftOut::to_string).collect()
}

#[test]
fn corrections_by_the_mapper_stay_out_of_the_odometry() {
    let (scans, left_out) = read(LOG);
    assert_eq!((scans.len(), left_out.len()), (2, 0));
    let first = (scans[0].odometry, scans[0].reference);
    assert_eq!(first, (Pose::new(1.0, 0.0, 0.0), Some(Pose::new(0.9, 0.1, 0.0))));
    assert_eq!(scans[1].odometry, Pose::new(1.0, 0.5, 0.0));
    assert_eq!((scans[0].ranges_m.as_slice(), scans[1].time_s), (&[1.5, 2.5, 81.9][..], 0.5));
}

/// Regression test: the step from the last ODOM line before a scan to the first one after it was always left out. With ODOM and
/// FLASER lines alternating, as in raw logs, the robot never moved.
#[test]
fn the_odometry_of_a_raw_log_is_taken_as_it_is() {
    let log: String = [0.0, 1.0, 2.0].map(|x| odom(x) + &flaser(x + 0.1, x + 0.1)).concat();
    let way: Vec<_> = read(log).0.into_iter().map(|scan| scan.odometry.x).collect();
    assert_eq!(way, [0.0, 1.0, 2.0]);
}

/// Regression test: gmapping's `scanstudio2carmen` writes no ODOM lines. The robot appeared to stand still, and was localized
/// without error.
#[test]
fn without_odom_lines_the_odometry_is_the_pose_of_the_scans() {
    let log: String = [0.0, 1.0, 2.5].map(|x| flaser(7.0 + x, x)).concat();
    let survey = Survey::of(log.as_bytes()).unwrap();
    let reading = survey.reading().unwrap();
    assert_eq!((reading.odometry, survey.odometry_distance_m(&reading)), (OdometrySource::Scans, 2.5));
    assert_eq!(survey.doubts(&reading), []);
    let (scans, _) = read(log);
    assert_eq!(scans.iter().map(|scan| scan.odometry.x).collect::<Vec<_>>(), [0.0, 1.0, 2.5]);
    assert_eq!(scans[2].reference.unwrap().x, 9.5);
    // ODOM lines that never change count as missing.
    let log: String = [0.0, 1.0, 2.5].map(|x| odom(0.0) + &flaser(7.0 + x, x)).concat();
    assert_eq!(read(&log).0[2].odometry.x, 2.5);
    let survey = Survey::of(log.as_bytes()).unwrap();
    assert_eq!(survey.not_read(&survey.reading().unwrap())["ODOM"], 3);
}

#[test]
fn an_odometry_that_never_moves_is_doubted() {
    let doubts = |log: &str| {
        let survey = Survey::of(log.as_bytes()).unwrap();
        survey.doubts(&survey.reading().unwrap())
    };
    let still: String = [0.0, 1.0, 2.5].map(|x| odom(0.0) + &flaser(x, 0.0)).concat();
    assert_eq!(doubts(&still), [Doubt::Still { reference_m: 2.5 }]);
    let still: String = [0.0, 1.0, 2.5].map(|x| flaser(x, 0.0)).concat();
    assert_eq!(doubts(&still), [Doubt::Still { reference_m: 2.5 }]);
    assert_eq!(doubts(&flaser(0.0, 0.0).repeat(3)), [Doubt::Motionless]);
    let cut: String = [0.0, 1.0, 2.5].map(|x| odom(f64::min(x, 1.0)) + &flaser(x, x)).concat();
    assert_eq!(doubts(&cut), [Doubt::Partial { lines_m: 1.0, scans_m: 2.5 }]);
    let same: String = [0.0, 1.0].map(|x| flaser(x, x)).concat();
    assert_eq!(doubts(&same), [Doubt::SamePoses]);
    let turning = "FLASER 2 1 2 0 0 0 0 0 0 0 h 0\nFLASER 2 1 2 0 0 1 0 0 1.1 0 h 0\n";
    assert_eq!(doubts(turning), [Doubt::SamePoses], "to turn is to move");
}

/// Regression test: ODOM lines that ended after 3.0 m of 5.1 m, or accompanied only every twentieth scan, were accepted
/// silently, because only less than half of the distance raised a doubt. The robot stood still where the lines were missing.
#[test]
fn odom_lines_that_end_halfway_or_are_sparse_are_doubted() {
    let doubts = |log: &str| {
        let survey = Survey::of(log.as_bytes()).unwrap();
        survey.doubts(&survey.reading().unwrap())
    };
    let at = |i: usize| i as f64 / 8.0;
    let log = |has_odom: fn(usize) -> bool| -> String {
        let odom = |i| if has_odom(i) { odom(at(i)) } else { String::new() };
        (0..=40).map(|i| odom(i) + &flaser(at(i), at(i))).collect()
    };
    assert_eq!(doubts(&log(|_| true)), []);
    assert_eq!(doubts(&log(|i| i % 4 == 0)), [], "now and then is often enough");
    let gap = |line, gap_m, lines_m| [Doubt::Gap { line, gap_m, lines_m, scans_m: 5.0 }];
    assert_eq!(doubts(&log(|i| i <= 24)), gap(50, 2.0, 3.0));
    assert_eq!(doubts(&log(|i| i % 10 == 0)), gap(2, 1.125, 5.0));
    let words = gap(50, 2.0, 3.0)[0].to_string();
    assert!(words.starts_with("from line 50 on, the robot's own poses in the scans cover 2.0 m"), "{words}");
    // All lines exist, but the odometry stands still from 3 m on, or one line is far off.
    let stops: String = (0..=40).map(|i| odom(at(i.min(24))) + &flaser(at(i), at(i))).collect();
    assert_eq!(doubts(&stops), [Doubt::Partial { lines_m: 3.0, scans_m: 5.0 }]);
    let jumps = log(|_| true).replacen("ODOM 3.5 ", "ODOM 35 ", 1);
    assert_eq!(doubts(&jumps), [Doubt::Partial { lines_m: 67.75, scans_m: 5.0 }]);
    // Scans without motion cannot be compared with the lines.
    let states_none: String = [0.0, 1.0, 2.0].map(|x| odom(x) + &flaser(0.0, 0.0)).concat();
    assert_eq!(doubts(&states_none), []);
}

#[test]
fn the_number_of_fields_must_match_the_counts_in_the_line() {
    for (line, why) in [
        ("FLASER 3 1 2", "FLASER 3: expected 14 fields, found 4"),
        ("FLASER 2 1 2 0 0 0 0 0 0 1 h", "FLASER 2: expected 13 fields, found 12"),
        ("FLASER 2 1 2 1 0 0 0 0 0 0 1 h 0", "FLASER 2: expected 13 fields, found 14"),
        ("FLASER 4000000000 1", "FLASER, field 2: expected a number of readings, 2 to 1440"),
        ("FLASER 2 1 x 0 0 0 0 0 0 1 h 0", "FLASER, field 4: expected a range in metres, found \"x\""),
        ("FLASER 2 1 2 0 0 0 nan 0 0 1 h 0", "FLASER, field 8: expected a finite number of metres"),
        ("FLASER 2 1 2 0 0 0 1e9 0 0 1 h 0", "FLASER, field 8: expected a finite number of metres"),
        ("FLASER 2 1 2 0 0 0 0 0 0 inf h 0", "FLASER, field 11: expected a finite number, found \"inf\""),
        ("ODOM 0 0", "ODOM: expected 10 fields, found 3"),
        ("ODOM nan 0 0 0 0 0 1 h 1", "ODOM, field 2: expected a finite number of metres, found \"nan\""),
        ("\u{1}\u{2}garbage", "expected a known kind of line, such as FLASER, found \"\\u{1}\\u{2}garbage\""),
        ("RAWLASER1 0 -1.5 3 1 8 0 0 4 1 2 3", "RAWLASER1 4: expected 17 fields, found 12"),
        ("RAWLASER1 0 -1.5 3 1 8 0 0 4 1 2 3 4 0 1.5 h 1.5 2", "RAWLASER1 4: expected 17 fields, found 18"),
        (
            "RAWLASER1 0 -1.5 3 0.1 8 0 0 4 1 2 3 4 0 1.5 h 1.5",
            "RAWLASER1: expected a resolution that fits a field of view of 171.9°, found 5.7296° for 4 readings",
        ),
        (
            "RAWLASER1 0 -1.5 3 0 8 0 0 4 1 2 3 4 0 1.5 h 1.5",
            "RAWLASER1: expected a resolution that fits a field of view of 171.9°, found 0.0000°",
        ),
    ] {
        let (scans, left_out) = read(format!("{}{line}\n{}", flaser(0.0, 0.0), flaser(1.0, 1.0)));
        assert_eq!((scans.len(), left_out.len()), (2, 1), "{line}");
        assert!(left_out[0].to_string().starts_with(&format!("2: {why}")), "{}", left_out[0]);
    }
}

/// Regression test: a last line that was cut off caused the whole log to be refused. Garbled lines were silently ignored, and
/// so were lines from a host whose name is not UTF-8.
#[test]
fn reading_continues_after_an_unreadable_line() {
    let mut log = b"# Aufgenommen in Z\xfcrich\n".to_vec();
    log.extend(b"FLASER 2 1 2 0 0 0 0 0 0 1 h\xf4st 1\n");
    log.extend(b"FLASER 2 1 \xff\xfe 0 0 0 0 0 0 2 host 2\n");
    log.extend(vec![b'x'; MAX_LINE_BYTES as usize + 5]);
    log.extend(b"\r\n\nFLASER 2 1 2 1 0 0 1 0 0 3 host 3\r\nFLASER 2 1 2 2 0");
    let (scans, left_out) = read(log);
    assert_eq!(scans.iter().map(|scan| scan.line).collect::<Vec<_>>(), [2, 6]);
    let expected = [
        "3: FLASER, field 4: expected a range in metres, found \"\u{fffd}\u{fffd}\"",
        "4: expected a line of less than 256 KiB",
        "7: FLASER 2: expected 13 fields, found 6",
    ];
    assert_eq!(words(&left_out), expected);
}

/// Regression test: a compressed file that was cut off was refused.
#[test]
fn truncated_data_ends_the_log() {
    struct Cut<'a>(&'a [u8]);
    impl Read for Cut<'_> {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            match self.0.read(out)? {
                0 => Err(io::Error::new(io::ErrorKind::UnexpectedEof, "too early")),
                length => Ok(length),
            }
        }
    }
    let text = flaser(0.0, 0.0) + &flaser(1.0, 1.0) + "FLASER 2 1";
    let open = || BufReader::with_capacity(16, Cut(text.as_bytes()));
    let reading = Survey::of(open()).unwrap().reading().unwrap();
    let entries: Vec<_> = CarmenLog::new(open(), reading).map(Result::unwrap).collect();
    let [Entry::Scan(_), Entry::Scan(_), Entry::LeftOut(end)] = entries.as_slice() else {
        panic!("{entries:?}")
    };
    assert_eq!(end.to_string(), "3: the file breaks off here: too early");
}

/// Some readings are not distances, and one of them is next to a reading that means "no return".
#[test]
fn an_invalid_reading_does_not_affect_the_others() {
    let (scans, left_out) = read("FLASER 4 1 nan inf -1 0 0 0 0 0 0 1 h 1\n");
    assert_eq!((left_out.len(), scans[0].unreadable()), (0, 2));
    assert_eq!((scans[0].ranges_m[0], scans[0].ranges_m[2]), (1.0, f32::INFINITY));
}

/// Regression test: the poses were read one field too early, so the robot stood 80 m away.
#[test]
fn a_maximum_range_after_the_readings_is_not_taken_for_a_pose() {
    let line = |x: f64| format!("FLASER 2 1 2 80.0 {x} 0 0 {x} 0 0 {x} h 0\n");
    let log: String = [0.0, 1.0, 2.0].map(line).concat();
    let (scans, left_out) = read(&log);
    assert_eq!((scans.len(), left_out.len(), scans[2].range_max_m), (3, 0, Some(80.0)));
    assert_eq!(scans[2].reference.unwrap().x, 2.0);
    let survey = Survey::of(log.as_bytes()).unwrap();
    let doubts = survey.doubts(&survey.reading().unwrap());
    assert!(doubts.contains(&Doubt::Surplus { kind: ScanKind::Flaser, count: 3, value: 80.0 }), "{doubts:?}");
    // A field that differs from line to line is not a maximum range, but perhaps a reading that was not counted.
    let (scans, left_out) = read(log.replacen("80.0", "70.0", 1) + &flaser(3.0, 3.0));
    assert_eq!((scans.len(), left_out.len()), (1, 3));
}

/// Regression test: 401 readings over 100° were read as half a circle.
#[test]
fn the_field_of_view_follows_from_the_number_of_readings() {
    for (count, first_deg, step_deg) in [
        (180, -90.0, 1.0),
        (181, -90.0, 1.0),
        (360, -90.0, 0.5),
        (361, -90.0, 0.5),
        (400, -50.0, 0.25),
        (401, -50.0, 0.25),
        (402, -90.0, 180.0 / 402.0),
    ] {
        let beams = Beams::by_count(count);
        let found = [beams.angle_min_rad, beams.angle_increment_rad].map(f64::to_degrees);
        assert!((found[0] - first_deg).abs() + (found[1] - step_deg).abs() < 1e-9, "{count}: {found:?}");
    }
    let line = |count: usize| format!("FLASER {count} {}0 0 0 0 0 0 0 h 0\n", "1 ".repeat(count));
    let (scans, _) = read(line(181) + &line(361) + &line(361));
    assert_eq!(scans[0].beams, Beams::by_count(181));
    assert_eq!(scans[2].beams, Beams::by_count(361), "each scan has its own");
    let log = line(181) + &line(361) + &line(361);
    let survey = Survey::of(log.as_bytes()).unwrap();
    let shapes = survey.shapes(&survey.reading().unwrap()).unwrap();
    assert_eq!(shapes.most_frequent().unwrap().count, 361);
    assert_eq!(shapes.known.iter().map(|shape| shape.scans).collect::<Vec<_>>(), [1, 2]);
}

/// Regression test: the newer kinds of CARMEN lines were not read at all.
#[test]
fn lines_with_angles_are_read_with_those_angles() {
    let robot = |x: f64| {
        format!(
            "ROBOTLASER1 0 -1.0 2.0 0.5 30.0 0.01 0 5 1 2 3 4 5 2 700 701 {x} 1 0.5 {x} 0 0 0.1 0 0.3 0.2 0 {x} h 0\n"
        )
    };
    let (scans, left_out) = read(robot(0.0) + &robot(1.5));
    assert_eq!((scans.len(), words(&left_out)), (2, vec![]));
    let scan = &scans[1];
    assert_eq!(scan.beams, Beams { angle_min_rad: -1.0, angle_increment_rad: 0.5 });
    assert_eq!((scan.range_max_m, scan.time_s, scan.ranges_m.len()), (Some(30.0), 1.5, 5));
    assert_eq!(scan.reference, Some(Pose::new(1.5, 1.0, 0.5)), "the laser's pose comes first");
    assert_eq!(scan.odometry, Pose::new(1.5, 0.0, 0.0));
    let raw = "RAWLASER1 0 -1.0 2.0 0.5 0 0.01 0 4 1 2 3 4 0 7.5 h 0\n";
    let (scans, _) = read(odom(0.0) + raw + &odom(1.0) + raw);
    assert_eq!((scans[1].reference, scans[1].odometry.x, scans[1].range_max_m), (None, 1.0, None));
    let error = Survey::of(raw.as_bytes()).unwrap().reading().unwrap_err().to_string();
    assert!(error.starts_with("expected ODOM lines in addition to RAWLASER1 lines"), "{error}");
    // CARMEN's logger writes each scan twice if it is asked for both kinds.
    let log = [0.0, 1.0].map(|x| odom(x) + raw + &robot(x)).concat();
    let survey = Survey::of(log.as_bytes()).unwrap();
    let reading = survey.reading().unwrap();
    assert_eq!((reading.kind, survey.not_read(&reading)["RAWLASER1"]), (ScanKind::RobotLaser1, 2));
    assert_eq!(read(log).0.len(), 2);
}

#[test]
fn the_error_for_a_log_without_scans_lists_its_lines() {
    let found = |log: &str| Survey::of(log.as_bytes()).unwrap().reading().unwrap_err().to_string();
    let expected = "expected FLASER, ROBOTLASER1 or RAWLASER1 lines, found";
    assert_eq!(found(""), format!("{expected} none"));
    let log = format!("{}PARAM a b\nRLASER 2\nRLASER 2\nFLASER 3 1\n", odom(0.0));
    let rest =
        "1 ODOM, 1 PARAM, 2 RLASER lines; 1 lines cannot be read, the first is line 5: FLASER 3: expected";
    assert!(found(&log).starts_with(&format!("{expected} {rest}")), "{}", found(&log));
}

proptest! {
    #[test]
    fn arbitrary_text_is_read_or_skipped(
        text in "(FLASER|ROBOTLASER1|RAWLASER1|ODOM|[0-9 .eE+-]|\n|nan|h){0,60}",
    ) {
        if let Ok(reading) = Survey::of(text.as_bytes()).unwrap().reading() {
            let entries = CarmenLog::new(text.as_bytes(), reading).collect::<Result<Vec<_>, _>>().unwrap();
            prop_assert!(!entries.is_empty());
        }
    }

    /// Wherever a line is cut off, the parser reads nothing that the line does not contain.
    #[test]
    fn a_truncated_line_is_skipped(cut in 7_usize..40) {
        let line = "FLASER 3 1.5 2.5 3.5 9 0.1 0 9 0.1 0 0.25 h";
        let (scans, left_out) = read(flaser(0.0, 0.0) + &line[..cut.min(line.len())]);
        prop_assert_eq!((scans.len(), left_out.len()), (1, 1));
    }
}
