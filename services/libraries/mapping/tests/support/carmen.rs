//! Reads corrected CARMEN logs. Each scan comes with its reference pose and with odometry chained over the ODOM lines.

use std::io::{BufRead, BufReader};
use std::path::Path;

use sketchnav_schemas::geometry::{Odom, Pose, World};

/// A scan from a log.
pub struct LogScan {
    pub ranges_m: Vec<f32>,
    pub reference: Pose<World>,
    pub odometry: Pose<Odom>,
}

/// Reads all scans of a log. Returns `None` and prints a notice if the file is missing.
#[allow(clippy::disallowed_methods, reason = "a test reads its data")]
pub fn read(path: &Path) -> Option<Vec<LogScan>> {
    let Ok(file) = std::fs::File::open(path) else {
        eprintln!("skipped: {} is missing", path.display());
        return None;
    };
    let lines = BufReader::new(flate2::read::GzDecoder::new(file)).lines();
    let (mut scans, mut last, mut odometry) = (Vec::new(), None::<Pose<Odom>>, Pose::new(0.0, 0.0, 0.0));
    for line in lines {
        let line = line.unwrap();
        let mut words = line.split_ascii_whitespace();
        let word = words.next();
        let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
        match word {
            // In these logs the first ODOM line after a scan repeats the scan's reference pose.
            Some("ODOM") => {
                let now = Pose::new(numbers[0], numbers[1], numbers[2]);
                if let Some(before) = last.replace(now) {
                    odometry = odometry.compose(&before.motion_to(&now));
                }
            }
            Some("FLASER") => {
                let count = numbers[0] as usize;
                let ranges_m = numbers[1..=count].iter().map(|range| *range as f32).collect();
                let at = &numbers[1 + count..];
                scans.push(LogScan { ranges_m, reference: Pose::new(at[0], at[1], at[2]), odometry });
                last = None;
            }
            _ => {}
        }
    }
    Some(scans)
}
