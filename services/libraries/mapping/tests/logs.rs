//! Runs local mapping on real logs and compares its errors with those of the odometry alone. Errors are those of relative poses,
//! with respect to the logs' corrected poses (the metric of Burgard et al. 2009). The detector of kidnapping runs on the same logs. If
//! the logs are missing, these tests are skipped with a notice.

mod support;

use sketchnav_mapping::{KidnapDetector, Mapper, Outcome, Parameters, Scan};
use sketchnav_schemas::geometry::{Odom, Pose};
use support::carmen::{self, LogScan};

/// A pose in any frame, as plain numbers.
type Plain = Pose<sketchnav_mapping::Map>;

fn scan(of: &LogScan) -> Scan<'_> {
    let beams = of.ranges_m.len() as f64;
    Scan {
        ranges_m: &of.ranges_m,
        first_rad: -std::f64::consts::FRAC_PI_2,
        step_rad: std::f64::consts::PI / beams,
        range_min_m: 0.05,
        range_max_m: 40.0,
        base_from_laser: Pose::new(0.0, 0.0, 0.0),
    }
}

/// Mean errors, in metres and degrees, of relative poses between scans that are some distance apart.
#[derive(Debug, Clone, Copy)]
struct Errors {
    m: f64,
    deg: f64,
    worst_m: f64,
}

fn relative(reference: &[Plain], found: &[Plain], distance_m: f64) -> Errors {
    let mut driven = vec![0.0];
    for pair in reference.windows(2) {
        driven.push(driven.last().unwrap() + pair[0].position().distance(&pair[1].position()));
    }
    let (mut count, mut errors) = (0.0, Errors { m: 0.0, deg: 0.0, worst_m: 0.0 });
    for from in 0..reference.len() {
        let to = driven.partition_point(|at| *at < driven[from] + distance_m);
        if to < reference.len() {
            let truth = reference[from].motion_to(&reference[to]);
            let off = truth_off(&truth, &found[from].motion_to(&found[to]));
            errors.m += off.0;
            errors.deg += off.1;
            errors.worst_m = errors.worst_m.max(off.0);
            count += 1.0;
        }
    }
    Errors { m: errors.m / count, deg: errors.deg / count, ..errors }
}

fn truth_off<F>(truth: &Pose<F>, found: &Pose<F>) -> (f64, f64) {
    let off = truth.motion_to(found);
    (off.x.hypot(off.y), off.yaw_rad.abs().to_degrees())
}

/// Prints and returns the errors after 1, 5 and 20 m, first those of the odometry and then those of the mapper.
fn errors(name: &str, scans: &[LogScan], parameters: Parameters) -> [[Errors; 2]; 3] {
    let mut mapper = Mapper::new(parameters).unwrap();
    let plain = |x: f64, y: f64, yaw: f64| Plain::new(x, y, yaw);
    let (mut found, mut entered) = (Vec::new(), 0);
    for one in scans {
        let outcome = mapper.update(one.odometry, &scan(one)).unwrap();
        entered += usize::from(matches!(outcome, Outcome::Entered(_)));
        found.push(mapper.pose());
    }
    let reference: Vec<_> =
        scans.iter().map(|s| plain(s.reference.x, s.reference.y, s.reference.yaw_rad)).collect();
    let odometry: Vec<_> =
        scans.iter().map(|s| plain(s.odometry.x, s.odometry.y, s.odometry.yaw_rad)).collect();
    println!("{name}: {} scans, {entered} entered, {} tiles", scans.len(), mapper.map().tiles());
    [1.0, 5.0, 20.0].map(|distance_m| {
        let (by_wheels, by_map) =
            (relative(&reference, &odometry, distance_m), relative(&reference, &found, distance_m));
        for (who, e) in [("odometry", by_wheels), ("mapper", by_map)] {
            println!("  {distance_m:4} m {who:9} {:.3} m (worst {:.2}) {:.2} deg", e.m, e.worst_m, e.deg);
        }
        [by_wheels, by_map]
    })
}

/// Asserts that the mapper's errors are below the given bounds, and below those of the odometry.
fn is_as_good(errors: &[[Errors; 2]; 3], most_m: [f64; 3]) {
    for ([by_wheels, by_map], most_m) in errors.iter().zip(most_m) {
        assert!(by_map.m < most_m && by_map.m < by_wheels.m && by_map.deg < by_wheels.deg, "{by_map:?}");
    }
}

#[test]
fn freiburg_079() {
    let Some(scans) = carmen::read(&needs::data().join("logs/freiburg-079-corrected.log.gz")) else {
        return;
    };
    let errors = errors("Freiburg, Building 079", &scans, Parameters::default());
    // Measured: 0.05, 0.08 and 0.15 m.
    is_as_good(&errors, [0.07, 0.12, 0.25]);
}

#[test]
fn intel() {
    let Some(scans) = carmen::read(&needs::data().join("logs/intel-corrected.log.gz")) else { return };
    let errors = errors("Intel Research Lab", &scans, Parameters::default());
    // Measured: 0.05, 0.10 and 0.29 m.
    is_as_good(&errors, [0.07, 0.14, 0.40]);
}

/// Returns the scans at which the detector says that the robot was carried.
fn carries<'a>(scans: impl Iterator<Item = (Pose<Odom>, &'a LogScan)>) -> Vec<usize> {
    let mut detector = KidnapDetector::default();
    let said = scans.map(|(odometry, seen)| detector.observe(odometry, &scan(seen)));
    said.enumerate().filter_map(|(k, is_carried)| is_carried.then_some(k)).collect()
}

/// Counts how many of 60 robots notice that they are carried between two places of a log, where 60 scans are made each.
fn noticed(scans: &[LogScan]) -> usize {
    const STAY: usize = 60;
    let stay = |seed: usize| (seed % (scans.len() - 2 * STAY))..;
    let is_noticed = |k: usize| {
        let [before, after] =
            [7919 * k, 104_729 * k + scans.len() / 3].map(stay).map(|from| &scans[from][..STAY]);
        let carried =
            |one: &LogScan| before[STAY - 1].odometry.compose(&after[0].odometry.motion_to(&one.odometry));
        let first = before.iter().map(|one| (one.odometry, one));
        carries(first.chain(after.iter().map(|one| (carried(one), one)))).iter().any(|at| *at >= STAY)
    };
    (0..60).filter(|k| is_noticed(*k)).count()
}

#[test]
fn driving_is_mistaken_for_being_carried_only_where_the_odometry_is_wrong() {
    let read = |name: &str| carmen::read(&needs::data().join("logs").join(name));
    let names = ["freiburg-079-corrected.log.gz", "intel-corrected.log.gz"];
    let [Some(freiburg), Some(intel)] = names.map(read) else { return };
    let driven = |scans: &[LogScan]| carries(scans.iter().map(|one| (one.odometry, one)));
    // Twice, the odometry of the Freiburg log says the opposite of how the robot moved, for a metre.
    assert_eq!(driven(&freiburg), [850, 921]);
    assert_eq!(driven(&intel), [] as [usize; 0]);
    let count = noticed(&freiburg);
    println!("noticed: {count} of 60");
    // Measured: 45 of 60.
    assert!(count >= 40, "{count}");
}
