//! The cost of a drive in time, commands, messages, computation and energy (Patil 2019, 5.5, tables 5.1 and 5.2).
//!
//! The thesis could not compare energy as intended, because the battery display showed only whole volts. Here, energy is computed
//! by a model: a robot that is switched on draws [`IDLE_W`], rolling requires a force of [`ROLLING`] times its weight, acceleration
//! costs the kinetic energy, and braking does not recover energy.

use serde::{Deserialize, Serialize};
use sketchnav_schemas::message::{GroundTruth, Twist, VelocityCommand};
use sketchnav_schemas::time::seconds;
use sketchnav_sim::WorldDescription;
use sketchnav_sim::convex::Convex;

use crate::experiments::outcome::TaskOutcome;
use crate::experiments::table::Table;

/// Power of the computer and electronics, in watts. A youBot's 24 V and 5 Ah last for about 90 minutes (Patil 2019, 4.1), which is
/// 80 W with the motors. 20 W of this is assumed to go into driving.
pub const IDLE_W: f64 = 60.0;
/// Rolling resistance as a share of the weight. An assumption for mecanum wheels on a hard floor.
pub const ROLLING: f64 = 0.05;
const GRAVITY_MPS2: f64 = 9.81;

/// The cost of a task.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Cost {
    /// Number of velocity commands.
    pub commands: u64,
    /// Number of commands that differ from the preceding command.
    pub changed_commands: u64,
    /// Number of messages on all channels.
    pub messages: u64,
    /// Wall-clock time that localizer and planner spent computing, in seconds, which differs between any two runs.
    pub busy_s: f64,
    /// Energy according to the model, in joules.
    pub energy_j: f64,
    /// Minimum distance of the footprint from walls and furniture, in metres. Measured only if contacts end the drive.
    pub clearance_m: Option<f64>,
    /// Root mean square of the true jerk, in m/s³.
    pub jerk_mps3: f64,
}

impl Cost {
    /// Computes the cost from the commands and the true motion of a task that took `time_s`, for a robot of `mass_kg`.
    pub fn new(commands: &[VelocityCommand], truth: &[GroundTruth], time_s: f64, mass_kg: f64) -> Self {
        let bits = |twist: &Twist| [twist.vx_mps, twist.vy_mps, twist.yaw_rate_radps].map(f64::to_bits);
        let changes = commands.windows(2).filter(|pair| bits(&pair[0].twist) != bits(&pair[1].twist)).count();
        Self {
            commands: commands.len() as u64,
            changed_commands: changes as u64 + u64::from(!commands.is_empty()),
            energy_j: IDLE_W * time_s + motion_j(truth, mass_kg),
            jerk_mps3: jerk_mps3(truth),
            ..Self::default()
        }
    }
}

/// Returns the energy spent on the motion itself, in joules.
fn motion_j(truth: &[GroundTruth], mass_kg: f64) -> f64 {
    let speed = |truth: &GroundTruth| truth.twist.vx_mps.hypot(truth.twist.vy_mps);
    let step = |pair: &[GroundTruth]| {
        let distance_m = pair[0].pose().position().distance(&pair[1].pose().position());
        let faster = (speed(&pair[1]).powi(2) - speed(&pair[0]).powi(2)).max(0.0);
        ROLLING * mass_kg * GRAVITY_MPS2 * distance_m + 0.5 * mass_kg * faster
    };
    truth.windows(2).map(step).sum()
}

/// Returns the root mean square of the jerk, which is the second difference of the velocity.
fn jerk_mps3(truth: &[GroundTruth]) -> f64 {
    let velocity = |truth: &GroundTruth| {
        let (sin, cos) = truth.pose().yaw_rad.sin_cos();
        let Twist { vx_mps, vy_mps, .. } = truth.twist;
        [vx_mps * cos - vy_mps * sin, vx_mps * sin + vy_mps * cos]
    };
    let jerk = |three: &[GroundTruth]| {
        let dt_s = seconds(three[2].header.stamp_ns - three[0].header.stamp_ns) / 2.0;
        let [a, b, c] = [0, 1, 2].map(|i| velocity(&three[i]));
        [0, 1]
            .map(|axis| ((c[axis] - 2.0 * b[axis] + a[axis]) / dt_s.powi(2).max(1e-9)).powi(2))
            .iter()
            .sum::<f64>()
    };
    let squares: Vec<f64> = truth.windows(3).map(jerk).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Returns the minimum distance of a rectangular footprint from obstacles, in metres, or `None` if there are no obstacles
/// or the robot did not drive.
pub fn clearance_m(truth: &[GroundTruth], half_extents_m: [f64; 2], world: &WorldDescription) -> Option<f64> {
    let faces: Vec<_> =
        world.outline.iter().copied().chain(world.furniture.iter().flat_map(Convex::edges)).collect();
    let nearest = |truth: &GroundTruth| {
        let pose = truth.pose();
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let own = |at: [f64; 2]| {
            let (x, y) = (at[0] - pose.x, at[1] - pose.y);
            [x * cos + y * sin, y * cos - x * sin]
        };
        faces.iter().map(|face| from_box_m(face.map(own), half_extents_m)).fold(f64::INFINITY, f64::min)
    };
    truth.iter().map(nearest).min_by(f64::total_cmp).filter(|least_m| least_m.is_finite())
}

/// Returns the distance from a segment to a box around the origin, or 0 if they meet. The shortest distance between two convex
/// shapes is always at a corner of one of them.
fn from_box_m([a, b]: [[f64; 2]; 2], half: [f64; 2]) -> f64 {
    let outside = |p: [f64; 2]| (p[0].abs() - half[0]).max(0.0).hypot((p[1].abs() - half[1]).max(0.0));
    let along = [b[0] - a[0], b[1] - a[1]];
    let at = |share: f64| [a[0] + share * along[0], a[1] + share * along[1]];
    let square = (along[0].powi(2) + along[1].powi(2)).max(f64::MIN_POSITIVE);
    let from_corner = |corner: [f64; 2]| {
        let share = ((corner[0] - a[0]) * along[0] + (corner[1] - a[1]) * along[1]) / square;
        let [x, y] = at(share.clamp(0.0, 1.0));
        (x - corner[0]).hypot(y - corner[1])
    };
    let corners =
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[i, j]| [i * half[0], j * half[1]]);
    let nearest = corners.into_iter().map(from_corner).fold(outside(a).min(outside(b)), f64::min);
    if crosses([a, b], half) { 0.0 } else { nearest }
}

/// Returns true if a segment enters a box around the origin, which is found by clipping it to the sides of the box.
fn crosses([a, b]: [[f64; 2]; 2], half: [f64; 2]) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let step = b[axis] - a[axis];
        if step == 0.0 {
            if a[axis].abs() > half[axis] {
                return false;
            }
            continue;
        }
        let ends = [-half[axis], half[axis]].map(|side| (side - a[axis]) / step);
        from = from.max(ends[0].min(ends[1]));
        to = to.min(ends[0].max(ends[1]));
    }
    from <= to
}

/// Returns a row for each of `lines`, with the means over the tasks that were reached, and their minimum and maximum duration.
pub fn table(lines: &[String], outcomes: &[&TaskOutcome]) -> Table {
    let header = [
        "drives",
        "reached",
        "duration",
        "from – to",
        "commands",
        "a second",
        "without repetitions, a second",
        "messages a metre",
        "processor, ms a metre",
        "energy, J a metre",
        "least clearance, m",
        "jerk, m/s³",
    ];
    let header = std::iter::once("way").chain(header).map(str::to_owned).collect();
    Table { header, rows: lines.iter().map(|line| row(line, outcomes)).collect() }
}

fn row(line: &str, outcomes: &[&TaskOutcome]) -> Vec<String> {
    let all: Vec<_> = outcomes.iter().filter(|ended| ended.drawing == line).collect();
    let reached: Vec<_> = all.iter().filter(|ended| ended.is_success()).collect();
    let mean = |of: &dyn Fn(&TaskOutcome) -> f64| {
        let sum: f64 = reached.iter().map(|ended| of(ended)).sum();
        if reached.is_empty() { f64::NAN } else { sum / reached.len() as f64 }
    };
    let times = || reached.iter().map(|ended| ended.time_s);
    let (least, most) = (times().fold(f64::INFINITY, f64::min), times().fold(0.0, f64::max));
    let figure = |value: f64, digits: usize| match value.is_finite() {
        true => format!("{value:.digits$}"),
        false => "–".to_owned(),
    };
    let per_metre = |of: fn(&Cost) -> f64| mean(&|ended| of(&ended.cost) / ended.path_m.max(1e-9));
    vec![
        line.to_owned(),
        all.len().to_string(),
        reached.len().to_string(),
        format!("{} s", figure(mean(&|ended| ended.time_s), 1)),
        if reached.is_empty() { "–".to_owned() } else { format!("{least:.1} – {most:.1}") },
        figure(mean(&|ended| ended.cost.commands as f64), 0),
        figure(mean(&|ended| ended.cost.commands as f64 / ended.time_s.max(1e-9)), 1),
        figure(mean(&|ended| ended.cost.changed_commands as f64 / ended.time_s.max(1e-9)), 2),
        figure(per_metre(|cost| cost.messages as f64), 0),
        figure(per_metre(|cost| 1e3 * cost.busy_s), 2),
        figure(per_metre(|cost| cost.energy_j), 0),
        figure(reached.iter().filter_map(|ended| ended.cost.clearance_m).fold(f64::INFINITY, f64::min), 2),
        figure(mean(&|ended| ended.cost.jerk_mps3), 2),
    ]
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::{Pose, World};
    use sketchnav_schemas::message::PoseM;

    use super::*;

    fn command(vx_mps: f64) -> VelocityCommand {
        let twist = Twist { vx_mps, vy_mps: 0.0, yaw_rate_radps: 0.0 };
        VelocityCommand { twist, ..Zeroable::zeroed() }
    }

    #[test]
    fn repeated_commands_count_once() {
        let commands = [0.1, 0.1, 0.1, 0.2, 0.2, 0.1].map(command);
        let cost = Cost::new(&commands, &[], 0.0, 20.0);
        assert_eq!((cost.commands, cost.changed_commands), (6, 3));
        assert_eq!(Cost::new(&[], &[], 0.0, 20.0), Cost::default());
    }

    #[test]
    fn the_clearance_of_a_box_is_that_of_its_nearest_corner_or_side() {
        let half = [0.3, 0.2];
        for (segment, expected_m) in [
            ([[-5.0, 1.0], [5.0, 1.0]], 0.8),
            ([[1.3, -5.0], [1.3, 5.0]], 1.0),
            ([[0.6, 0.6], [5.0, 5.0]], 0.5),
            ([[-5.0, 0.1], [5.0, 0.1]], 0.0),
            ([[0.0, 0.0], [0.1, 0.1]], 0.0),
            ([[0.3, 5.0], [5.0, 0.2]], 3.358),
        ] {
            let found_m = from_box_m(segment, half);
            assert!((found_m - expected_m).abs() < 0.02, "{segment:?}: {found_m}");
        }
    }

    #[test]
    fn standing_costs_idle_power_and_driving_rolling_resistance() {
        let at = |x: f64, vx_mps: f64| GroundTruth {
            pose: PoseM::new(&Pose::<World>::new(x, 0.0, 0.0)),
            twist: Twist { vx_mps, vy_mps: 0.0, yaw_rate_radps: 0.0 },
            ..Zeroable::zeroed()
        };
        assert_eq!(Cost::new(&[], &[at(0.0, 0.0); 3], 10.0, 20.0).energy_j, 600.0);
        let driven = [at(0.0, 0.0), at(0.5, 1.0), at(1.0, 0.0)];
        let (rolling_j, kinetic_j) = (0.05 * 20.0 * 9.81, 0.5 * 20.0);
        let cost = Cost::new(&[], &driven, 0.0, 20.0);
        assert!((cost.energy_j - rolling_j - kinetic_j).abs() < 1e-9, "{cost:?}");
    }
}
