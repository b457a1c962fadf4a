//! Any robot or floor that is accepted can be simulated: the robot moves without a panic, and its sensors send valid messages.
//! `fuzz/` has the corresponding fuzz targets.

use std::convert::Infallible;

use proptest::prelude::*;
use sketchnav_schemas::channels::Channel;
use sketchnav_schemas::geometry::Pose;
use sketchnav_schemas::message::{Header, Twist, VelocityCommand};
use sketchnav_schemas::robot::Robot;
use sketchnav_schemas::ros2::Ros2;
use sketchnav_sim::plane_file::PlaneFile;
use sketchnav_sim::{DotPlane, Floor, Senses, Simulation, floor_plan, robots};

const ROOM: &str = "name='room'\nwall_thickness_m=0.2\n\
    [[wall]]\nclosed=true\npoints=[[0,0],[40,0],[40,40],[0,40]]\n";

/// Channels of the messages that were invalid.
struct Invalid(Vec<&'static str>);

impl Senses for Invalid {
    type Error = Infallible;

    fn reading<T: Ros2>(
        &mut self,
        channel: Channel<T>,
        stamp_ns: u64,
        fill: impl FnOnce(&mut T),
    ) -> Result<(), Infallible> {
        let mut message = T::zeroed();
        fill(&mut message);
        message.header_mut().seq = 1;
        message.header_mut().stamp_ns = stamp_ns;
        if !message.is_valid() {
            self.0.push(channel.spec.name);
        }
        Ok(())
    }
}

/// Drives for three instants, and returns the channels on which an invalid message was sent.
fn drive(mut floor: impl Simulation) -> Vec<&'static str> {
    let mut invalid = Invalid(Vec::new());
    for _ in 0..3 {
        let Ok(()) = floor.sense(&mut invalid);
        let header =
            Header { seq: floor.steps() + 1, stamp_ns: floor.stamp_ns(), source_seq: floor.steps() + 1 };
        let twist = Twist { vx_mps: 1e3, vy_mps: -1e3, yaw_rate_radps: 1e3 };
        floor.step(Some(&VelocityCommand { header, twist, last: 0, reserved: 0 }));
    }
    let Ok(()) = floor.sense(&mut invalid);
    invalid.0
}

/// Generates numbers that occur by mistake, and numbers at the limits of what is accepted.
fn number() -> impl Strategy<Value = f64> {
    const ODD: [f64; 20] = [
        0.0,
        1e-12,
        1e-3,
        0.01,
        0.1,
        0.99,
        1.0,
        7.99,
        10.0,
        30.0,
        179.0,
        360.0,
        1000.0,
        1e4,
        1e6,
        1e9,
        1e39,
        1e300,
        f64::NAN,
        f64::INFINITY,
    ];
    prop_oneof![3 => (0..ODD.len()).prop_map(|i| ODD[i]), 1 => 0.0..1.0_f64, 1 => any::<f64>()]
}

/// Returns a file with the numbers of some keys replaced.
fn changed(text: &str, changes: &[(prop::sample::Index, f64)]) -> String {
    let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
    let keyed: Vec<_> = (0..lines.len()).filter(|i| lines[*i].contains("= ")).collect();
    for (which, number) in changes {
        let line = &mut lines[keyed[which.index(keyed.len())]];
        if let Some((key, _)) = line.clone().split_once('=').filter(|(_, value)| !value.contains('"')) {
            *line = format!("{key}= {number:?}").replace("NaN", "nan");
        }
    }
    lines.join("\n")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_robot_moves_and_measures(
        which in 0..3_usize, changes in prop::collection::vec((any::<prop::sample::Index>(), number()), 1..4),
    ) {
        let files = [
            include_str!("../robots/nomad200.toml"),
            include_str!("../robots/robotino.toml"),
            include_str!("../robots/turtlebot3.toml"),
        ];
        if let Ok(robot) = Robot::parse(&changed(files[which], &changes)) {
            let floor = Floor::new(floor_plan::parse(ROOM).unwrap(), &robot, Pose::new(20.0, 20.0, 0.0), 1).unwrap();
            prop_assert_eq!(drive(floor), Vec::<&str>::new(), "{:?}", robot);
        }
    }

    #[test]
    fn any_helicopter_flies_and_sees(
        changes in prop::collection::vec((any::<prop::sample::Index>(), number()), 1..4),
    ) {
        let text = changed(include_str!("../robots/helicopter.toml"), &changes);
        if let Ok(robot) = Robot::parse(&text) {
            let dots = PlaneFile::parse("random = { dots = 100, side_m = 1.0, seed = 4 }").unwrap().describe(&[]).unwrap();
            let plane = DotPlane::new(dots, &robot, Pose::new(0.5, 0.5, 0.0), 1).unwrap();
            prop_assert_eq!(drive(plane), Vec::<&str>::new(), "{:?}", robot);
        }
    }

    /// Walls of 1e308 m, furniture at 1e39 m and tables of 1e-30 m never reach the physics.
    #[test]
    fn a_robot_moves_and_measures_on_any_floor(
        numbers in prop::collection::vec(number(), 14), signs in prop::collection::vec(any::<bool>(), 14),
    ) {
        let n: Vec<_> = numbers.iter().zip(&signs).map(|(n, minus)| if *minus { -n } else { *n }).collect();
        let text = format!(
            "{ROOM}[[wall]]\npoints=[[{:?},{:?}],[{:?},{:?}]]\n[[furniture]]\ncenter=[{:?},{:?}]\nsize=[{:?},{:?}]\n\
             [[furniture]]\npolygon=[[9,9],[{:?},{:?}],[9,10]]\n[[person]]\nwaypoints=[[30,30],[{:?},{:?}]]\n\
             speed_mps={:?}\nradius_m={:?}\n",
            n[0], n[1], n[2], n[3], n[4], n[5], numbers[6], numbers[7], n[8], n[9], n[10], n[11], numbers[12],
            numbers[13],
        );
        if let Ok(world) = floor_plan::parse(&text.replace("NaN", "nan")) {
            let robot = robots::find("robotino").unwrap().unwrap();
            if let Ok(floor) = Floor::new(world, &robot, Pose::new(20.0, 20.0, 0.0), 1) {
                prop_assert_eq!(drive(floor), Vec::<&str>::new(), "{}", text);
            }
        }
    }
}
