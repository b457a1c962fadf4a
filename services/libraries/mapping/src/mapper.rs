//! Local mapping over a whole drive. Odometry predicts the pose, scan matching corrects it, and the map is
//! built from the scans at the corrected poses.
//!
//! The mapper maintains a single pose and a single map, and does not close loops by moving mapped areas. The map is therefore
//! accurate over distances that can be seen at once, but drifts slowly beyond them. When the robot returns to an area and has
//! drifted by less than the search window, its scans are matched with the first ones taken there.
//!
//! [`Parameters::max_tiles`] bounds the size of the state. An update does not allocate.

use nalgebra::{Rotation2, Vector2};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::geometry::{Odom, Pose};
use sketchnav_schemas::message::MAX_BEAMS;

use crate::grid::floor;
use crate::matching::field::Field;
use crate::matching::{Fit, Matcher, Prior};
use crate::occupancy::Occupancy;
use crate::scan::{Beam, Scan};
use crate::{Error, Map, Parameters};

/// Distance, in metres, that the robot may drive before the field around it is redrawn.
const FIELD_MARGIN_M: f64 = 1.5;

/// The outcome of updating the mapper with a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// The scan was ignored because the robot has hardly moved.
    Skipped,
    /// The scan corrected the pose, or had nothing in range to match (`None`).
    Matched(Option<Fit>),
    /// The scan was added to the map. It also corrected the pose, except for the first scan and a scan with
    /// nothing in range to match (`None`).
    Entered(Option<Fit>),
}

/// Distance travelled in metres and angle turned in radians, both unsigned.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Driven {
    m: f64,
    rad: f64,
}

impl Driven {
    fn add(&mut self, m: f64, rad: f64) {
        self.m += m;
        self.rad += rad;
    }
}

/// The state of a mapper, as stored in a checkpoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    map: Occupancy,
    pose: Pose<Map>,
    odometry: Option<Pose<Odom>>,
    since_match: Driven,
    since_entry: Driven,
    scans_since_entry: u32,
    /// The map cell at the centre of the field.
    field_middle: [i32; 2],
}

/// Builds a map scan by scan.
#[derive(Debug)]
pub struct Mapper {
    parameters: Parameters,
    state: State,
    field: Field,
    matcher: Matcher,
    directions: Directions,
    touched: Vec<u32>,
}

/// The directions of a laser's beams, as unit vectors in the robot's frame. They are cached because they are the same for all scans
/// of a laser.
#[derive(Debug)]
struct Directions {
    /// Direction of beam 0, and angle from one beam to the next, in radians.
    laser: [f64; 2],
    beams: Vec<[f64; 2]>,
}

impl Directions {
    fn of(&mut self, scan: &Scan<'_>) -> &[[f64; 2]] {
        let laser = [scan.base_from_laser.yaw_rad + scan.first_rad, scan.step_rad];
        if self.laser != laser {
            self.laser = laser;
            self.beams.clear();
        }
        let known = self.beams.len();
        self.beams.extend((known..scan.ranges_m.len()).map(|beam| scan.direction(beam)));
        &self.beams
    }
}

impl Mapper {
    /// Creates a mapper with an empty map.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of bounds.
    pub fn new(parameters: Parameters) -> Result<Self, Error> {
        parameters.check()?;
        let state = State {
            map: Occupancy::new(&parameters),
            pose: Pose::new(0.0, 0.0, 0.0),
            odometry: None,
            since_match: Driven::default(),
            since_entry: Driven::default(),
            scans_since_entry: 0,
            field_middle: [0, 0],
        };
        Ok(Self::with(parameters, state))
    }

    /// Creates a mapper that resumes from a checkpoint.
    ///
    /// # Errors
    /// [`Error::Parameter`] if a parameter is out of bounds, and [`Error::State`] if the state does not match the parameters.
    pub fn restore(parameters: Parameters, state: State) -> Result<Self, Error> {
        parameters.check()?;
        let map = state.map.restored(&parameters)?;
        let numbers =
            [state.pose.x, state.pose.y, state.pose.yaw_rad, state.since_match.m, state.since_match.rad];
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(Error::State { expected: "finite numbers", found: format!("{numbers:?}") });
        }
        Ok(Self::with(parameters, State { map, ..state }))
    }

    fn with(parameters: Parameters, state: State) -> Self {
        let reach_m = parameters.matching_range_m + parameters.window_max_m + FIELD_MARGIN_M;
        let mut field = Field::new(parameters.cell_m, reach_m, parameters.blur_m);
        field.rebuild(&state.map, state.field_middle);
        // Reserve memory for all cells that the beams of a scan can reach.
        let range_cells = parameters.mapping_range_m / parameters.cell_m + 4.0;
        let touched = Vec::with_capacity((2.0 * range_cells).powi(2) as usize);
        let directions = Directions { laser: [0.0; 2], beams: Vec::with_capacity(MAX_BEAMS) };
        Self { matcher: Matcher::new(&parameters), parameters, state, field, directions, touched }
    }

    /// Returns the state to store in a checkpoint.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Returns the robot's pose as of the last update.
    pub fn pose(&self) -> Pose<Map> {
        self.state.pose
    }

    /// Returns the map.
    pub fn map(&self) -> &Occupancy {
        &self.state.map
    }

    /// Updates the pose and the map from an odometry pose and the scan taken there.
    ///
    /// # Errors
    /// [`Error::Scan`] if the scan or the odometry is invalid. The mapper then remains unchanged.
    pub fn update(&mut self, odometry: Pose<Odom>, scan: &Scan<'_>) -> Result<Outcome, Error> {
        scan.check()?;
        let numbers = [odometry.x, odometry.y, odometry.yaw_rad];
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(Error::Scan { expected: "finite odometry", found: format!("{numbers:?}") });
        }
        let is_first = self.state.odometry.is_none();
        self.advance(odometry);
        let enters = is_first || self.is_entry_due();
        if !enters && !self.is_match_due() {
            return Ok(Outcome::Skipped);
        }
        let fit = if is_first { None } else { self.correct(scan) };
        if enters {
            self.enter(scan);
        }
        Ok(if enters { Outcome::Entered(fit) } else { Outcome::Matched(fit) })
    }

    /// Adds a scan at a known pose, such as one of a corrected log, without matching it.
    ///
    /// # Errors
    /// [`Error::Scan`] if the scan or the pose is invalid. The mapper then remains unchanged.
    pub fn enter_at(&mut self, pose: Pose<Map>, scan: &Scan<'_>) -> Result<(), Error> {
        scan.check()?;
        let numbers = [pose.x, pose.y, pose.yaw_rad];
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(Error::Scan { expected: "finite pose", found: format!("{numbers:?}") });
        }
        self.state.pose = pose;
        self.follow_with_field();
        self.enter(scan);
        Ok(())
    }

    /// Moves the pose by the odometry's motion since the last update.
    fn advance(&mut self, odometry: Pose<Odom>) {
        if let Some(before) = self.state.odometry.replace(odometry) {
            let step = before.motion_to(&odometry);
            let (m, rad) = (step.x.hypot(step.y), step.yaw_rad.abs());
            self.state.pose = self.state.pose.compose(&step);
            self.state.since_match.add(m, rad);
            self.state.since_entry.add(m, rad);
            self.state.scans_since_entry += 1;
        }
    }

    fn is_match_due(&self) -> bool {
        let since = &self.state.since_match;
        since.m >= self.parameters.match_m || since.rad >= self.parameters.match_rad
    }

    fn is_entry_due(&self) -> bool {
        let since = &self.state.since_entry;
        let has_moved = since.m >= self.parameters.enter_m || since.rad >= self.parameters.enter_rad;
        has_moved || self.state.scans_since_entry >= self.parameters.enter_scans
    }

    fn correct(&mut self, scan: &Scan<'_>) -> Option<Fit> {
        self.follow_with_field();
        let directions = self.directions.of(scan);
        self.matcher.set_points(ends(scan, directions, self.parameters.matching_range_m));
        let fit = self.matcher.fit(&self.field, &self.prior())?;
        self.state.pose = fit.pose;
        self.state.since_match = Driven::default();
        Some(fit)
    }

    fn prior(&self) -> Prior {
        let (noise, since) = (&self.parameters.odometry, &self.state.since_match);
        Prior {
            pose: self.state.pose,
            sigma_m: noise.position_floor_m + noise.position_per_m * since.m,
            sigma_rad: noise.yaw_floor_rad + noise.yaw_per_m * since.m + noise.yaw_per_rad * since.rad,
        }
    }

    fn cell(&self) -> [i32; 2] {
        let pose = self.state.pose;
        [pose.x, pose.y].map(|at| (at / self.parameters.cell_m).floor().clamp(-1e8, 1e8) as i32)
    }

    fn follow_with_field(&mut self) {
        let (at, middle) = (self.cell(), self.state.field_middle);
        let off = (at[0] - middle[0]).abs().max((at[1] - middle[1]).abs());
        if f64::from(off) * self.parameters.cell_m > FIELD_MARGIN_M {
            self.state.field_middle = at;
            self.field.rebuild(&self.state.map, at);
        }
    }

    /// Enters a scan into the map at the current pose and redraws the field.
    fn enter(&mut self, scan: &Scan<'_>) {
        let (pose, parameters) = (self.state.pose, &self.parameters);
        let turned = Rotation2::new(pose.yaw_rad);
        let in_cells = |[x, y]: [f64; 2]| {
            let moved = turned * Vector2::new(x, y);
            [(pose.x + moved.x) / parameters.cell_m, (pose.y + moved.y) / parameters.cell_m]
        };
        let (mount, directions) =
            ([scan.base_from_laser.x, scan.base_from_laser.y], self.directions.of(scan));
        let end = |beam: usize, range_m: f64| {
            in_cells([0, 1].map(|axis| mount[axis] + range_m * directions[beam][axis]))
        };
        let mut entering = self.state.map.scan(&mut self.touched);
        for beam in 0..scan.ranges_m.len() {
            if let Beam::Hit(range_m) = scan.beam(beam)
                && range_m <= parameters.mapping_range_m
            {
                entering.hit(end(beam, range_m).map(floor));
            }
        }
        let laser = in_cells(mount);
        for beam in 0..scan.ranges_m.len() {
            match scan.beam(beam) {
                Beam::Hit(range_m) if range_m <= parameters.mapping_range_m => {
                    entering.pass(laser, end(beam, range_m), 1.0);
                }
                Beam::Hit(_) => entering.pass(laser, end(beam, parameters.mapping_range_m), 0.0),
                Beam::Open if parameters.open_range_m > 0.0 => {
                    let range_m = parameters.open_range_m.min(scan.range_max_m);
                    entering.pass(laser, end(beam, range_m), 0.0);
                }
                Beam::Open | Beam::Invalid => {}
            }
        }
        drop(entering);
        self.state.since_entry = Driven::default();
        self.state.scans_since_entry = 0;
        self.state.field_middle = self.cell();
        self.field.rebuild(&self.state.map, self.state.field_middle);
    }
}

/// Returns the endpoints of the beams that are no longer than `longest_m`, in the robot's frame.
fn ends<'a>(
    scan: &'a Scan<'a>,
    directions: &'a [[f64; 2]],
    longest_m: f64,
) -> impl Iterator<Item = [f64; 2]> + 'a {
    let mount = [scan.base_from_laser.x, scan.base_from_laser.y];
    (0..scan.ranges_m.len()).filter_map(move |beam| match scan.beam(beam) {
        Beam::Hit(range_m) if range_m <= longest_m => {
            Some([0, 1].map(|axis| mount[axis] + range_m * directions[beam][axis]))
        }
        _ => None,
    })
}
