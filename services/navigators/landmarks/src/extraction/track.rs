//! Predicts what the robot sees and does at each step along the drawn route (Chronis 2007, 4.3 to 4.3.4).
//!
//! The thesis calls the turning rate "normalized" and gives a threshold of 0.7, but no unit. We interpret it as degrees per pixel
//! of the PDA (5 inches). In this unit, the robot's own turning rate, 10° per second at 25 inches per second, is 2. Turns in the
//! examples of figure 4.29 (8 to 10 steps for a right angle) have about the same rate.

use sketchnav_qualitative as qualitative;
use sketchnav_qualitative::hof::{Force, Grade, Pair, Polygon, Surround, View, Workspace};
use sketchnav_schemas::geometry::{Point, wrap_angle};

use super::Parameters;
use crate::drawn::{Drawn, DrawnMetres};
use crate::error::Error;
use crate::plane;
use crate::route::{Command, DIRECTIONS, Place};
use crate::sketch::Sketch;

/// Number of directions of a histogram (Chronis 2007, 3.2.1), which is also the scale of widths.
pub const HISTOGRAM: usize = 180;

/// An object as seen from a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Index of the landmark in the sketch.
    pub landmark: usize,
    /// Place of the object relative to the robot.
    pub place: Place,
    /// Distance of the object's nearest point from the robot's box, in metres.
    pub proximity_m: f64,
    /// Width of the object's histogram of constant forces, from 0 to 180.
    pub width: f64,
}

/// A step along the route.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Position of the step.
    pub at: Point<Drawn>,
    /// Heading of the robot, in radians counter-clockwise from x.
    pub heading_rad: f64,
    /// Turning rate, in the unit of [`Parameters::turn_threshold`], positive to the left.
    pub turning_rate: f64,
    /// Command carried out at the step.
    pub command: Command,
    /// Objects in view, in the order in which they were drawn.
    pub sights: Vec<Sight>,
}

/// A section of the route with a single command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Command along the section.
    pub command: Command,
    /// Absolute angle by which the robot turns along the section, in radians.
    pub turned_rad: f64,
}

/// Returns the sections of a route, in order from its start. Each begins with a state, and the last one also ends with a state.
pub fn pieces(route: &[Point<Drawn>], parameters: &Parameters) -> Vec<Piece> {
    let headings = headings(route);
    let commands = commands(&turning_rates(route, &headings, parameters), &headings, parameters);
    let last = route.len() - 1;
    let piece = |[begin, end]: [usize; 2]| {
        let turned = headings[begin..=end.min(last)].windows(2).map(|pair| wrap_angle(pair[1] - pair[0]));
        Piece { command: commands[begin], turned_rad: turned.sum::<f64>().abs() }
    };
    // A change at the last step does not count, since the robot stops there.
    runs(&commands).into_iter().filter(|[begin, _]| *begin == 0 || *begin < last).map(piece).collect()
}

/// The steps along a route.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The steps, from the start.
    pub steps: Vec<Step>,
    /// Indices of the landmarks in the order in which they come into view (the "sequential numbers" of 4.3).
    pub encountered: Vec<usize>,
}

impl Track {
    /// Walks along the route of a sketch.
    ///
    /// # Errors
    /// [`Error::Number`] if an outline has no area.
    pub fn of(sketch: &Sketch, parameters: &Parameters) -> Result<Self, Error> {
        let headings = headings(&sketch.route);
        let rates = turning_rates(&sketch.route, &headings, parameters);
        let commands = commands(&rates, &headings, parameters);
        let mut eye = Eye::new(sketch, parameters)?;
        let mut steps = Vec::with_capacity(sketch.route.len());
        for (i, at) in sketch.route.iter().enumerate() {
            let sights = eye.look(*at, headings[i])?;
            let (turning_rate, command) = (rates[i], commands[i]);
            steps.push(Step { at: *at, heading_rad: headings[i], turning_rate, command, sights });
        }
        let mut encountered = Vec::new();
        for sight in steps.iter().flat_map(|step| &step.sights) {
            if !encountered.contains(&sight.landmark) {
                encountered.push(sight.landmark);
            }
        }
        Ok(Self { steps, encountered })
    }

    /// Returns the distance of a step from the start, along the route.
    pub fn along(&self, step: usize) -> DrawnMetres {
        DrawnMetres(self.steps[..=step].windows(2).map(|pair| pair[0].at.distance(&pair[1].at)).sum())
    }

    /// Returns the absolute angle by which the robot turns between two steps, in radians.
    pub fn turned_rad(&self, from: usize, to: usize) -> f64 {
        let turns = self.steps[from..=to].windows(2);
        turns.map(|pair| wrap_angle(pair[1].heading_rad - pair[0].heading_rad)).sum::<f64>().abs()
    }

    /// Returns the steps at which the command changes, excluding the first step.
    pub fn changes(&self) -> Vec<usize> {
        (1..self.steps.len()).filter(|i| self.steps[*i].command != self.steps[i - 1].command).collect()
    }
}

/// Returns the heading at each point of the route: "averaging 5 adjacent points (centered on the considered trajectory point)"
/// (4.3). Since the steps have equal lengths, the mean direction is that from two points before to two points after. Near the ends
/// of the route, fewer points are used.
pub fn headings<F>(route: &[Point<F>]) -> Vec<f64> {
    let last = route.len() - 1;
    (0..=last).map(|i| route[i.saturating_sub(2)].direction_rad(&route[(i + 2).min(last)])).collect()
}

/// Returns the turning rates: the change of the heading from the previous point, divided by the distance from there (4.3.4).
fn turning_rates(route: &[Point<Drawn>], headings: &[f64], parameters: &Parameters) -> Vec<f64> {
    let rate = |i: usize| {
        let turn = wrap_angle(headings[i] - headings[i - 1]).to_degrees();
        turn / route[i - 1].distance(&route[i]) * parameters.turn_unit_m
    };
    (0..route.len()).map(|i| rate(i.max(1))).collect()
}

/// Returns the commands, without spurious changes. Figure 4.11 swaps left and right compared with 4.3.4, which says that left is
/// positive. We follow 4.3.4.
fn commands(rates: &[f64], headings: &[f64], parameters: &Parameters) -> Vec<Command> {
    let command = |rate: f64| match rate {
        rate if rate > parameters.turn_threshold => Command::Left,
        rate if rate < -parameters.turn_threshold => Command::Right,
        _ => Command::Forward,
    };
    let mut commands: Vec<_> = rates.iter().map(|rate| command(*rate)).collect();
    // A short straight section within a turn is part of the turn.
    for [begin, end] in runs(&commands) {
        let is_within = begin > 0 && end < commands.len() && commands[begin - 1] == commands[end];
        if commands[begin] == Command::Forward && end - begin < parameters.least_steps && is_within {
            let turn = commands[end];
            commands[begin..end].fill(turn);
        }
    }
    // A turn that is too short or too small does not count.
    for [begin, end] in runs(&commands) {
        let turned: f64 = (begin.max(1)..end).map(|i| wrap_angle(headings[i] - headings[i - 1])).sum();
        let is_spurious = end - begin < parameters.least_steps || turned.abs() < parameters.least_turn_rad;
        if commands[begin].is_turn() && is_spurious {
            commands[begin..end].fill(Command::Forward);
        }
    }
    commands
}

/// Returns the runs of equal commands, as half-open ranges.
fn runs(commands: &[Command]) -> Vec<[usize; 2]> {
    let mut begin = 0;
    let ends = commands.chunk_by(|a, b| a == b).map(|run| {
        begin += run.len();
        [begin - run.len(), begin]
    });
    ends.collect()
}

/// Computes which objects are in view in a sketch, and how they are seen.
struct Eye {
    outlines: Vec<Vec<Point<Drawn>>>,
    polygons: Vec<Polygon>,
    robot_m: f64,
    radius_m: f64,
    pair: Pair,
    workspace: Workspace,
    forces: [Vec<Force>; 2],
}

impl Eye {
    fn new(sketch: &Sketch, parameters: &Parameters) -> Result<Self, Error> {
        let polygon = |outline: &Vec<Point<Drawn>>| polygon(outline);
        let outlines: Vec<_> = sketch.landmarks.iter().map(|landmark| landmark.outline.clone()).collect();
        Ok(Self {
            polygons: outlines.iter().map(polygon).collect::<Result<_, _>>()?,
            outlines,
            robot_m: parameters.robot_m,
            radius_m: parameters.sensor_radius_m,
            pair: Pair::default(),
            workspace: Workspace::default(),
            forces: [vec![Force::ZERO; HISTOGRAM], vec![Force::ZERO; HISTOGRAM]],
        })
    }

    /// Returns the objects in view. An object is in view as a whole if any of its points lies within the radius (4.3).
    fn look(&mut self, at: Point<Drawn>, heading_rad: f64) -> Result<Vec<Sight>, Error> {
        let half = self.robot_m / 2.0;
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let robot = polygon(&corners.map(|[x, y]| Point::new(at.x + x, at.y + y)))?;
        let mut sights = Vec::new();
        for landmark in 0..self.polygons.len() {
            if plane::distance_to_outline(at, &self.outlines[landmark]) > self.radius_m {
                continue;
            }
            let object = &self.polygons[landmark];
            self.pair.prepare(object, &robot);
            for (exponent, forces) in [0.0, 2.0].into_iter().zip(&mut self.forces) {
                // Neither exponent is out of range, so this cannot fail.
                let _ = self.pair.histogram_into(exponent, forces, &mut self.workspace);
            }
            let [constant, gravitational] = &self.forces;
            if let Some((place, width)) = place(constant, gravitational, heading_rad) {
                sights.push(Sight { landmark, place, proximity_m: object.distance(&robot), width });
            }
        }
        Ok(sights)
    }
}

fn polygon(outline: &[Point<Drawn>]) -> Result<Polygon, Error> {
    let points = outline.iter().map(|at| qualitative::Point::try_from(<[f64; 2]>::from(*at)));
    let points = points.collect::<Result<Vec<_>, _>>();
    points.and_then(Polygon::new).map_err(|_| Error::Number {
        what: "outline of an object".into(),
        expected: "an area above 0",
        found: plane::area(outline),
    })
}

/// Returns the place of an object, and its width from 0 to 180, given its histograms of constant and of gravitational forces
/// (4.3.1, 4.5.2). The place is the direction with the highest degree of truth, or a surround relation if no direction is
/// satisfactory. Returns `None` if there are no forces.
pub fn place(constant: &[Force], gravitational: &[Force], heading_rad: f64) -> Option<(Place, f64)> {
    let [constant, gravitational] = [constant, gravitational].map(|forces| View::new(forces, heading_rad));
    let directions = usize::from(DIRECTIONS);
    let found = constant.assess_with(&gravitational, directions)?;
    let width_rad = constant.width_rad();
    let width = width_rad / std::f64::consts::TAU * HISTOGRAM as f64;
    let direction = Place::Direction(found.direction as u8);
    if found.grade() > Grade::Unsatisfactory {
        return Some((direction, width));
    }
    // A direction without a force is a way out: the robot's box can leave through it without touching anything.
    let can_escape = constant.opening().is_some();
    let surround = Surround::by_width(width_rad, found.direction, directions, can_escape);
    Some((surround.map_or(direction, Place::Surrounds), width))
}
