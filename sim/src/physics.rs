//! Rigid-body physics with rapier2d. The robot is a dynamic disc or rectangle, people are kinematic discs, and walls and
//! furniture are fixed. The world is seen from above, so there is no gravity.
//!
//! Contacts are counted per body. The building with all its walls is one body, and so is each piece of
//! furniture and each person. A contact only counts if the solver responds to it with an impulse.

use nalgebra::Vector2;
use rapier2d::parry::query;
use rapier2d::prelude::*;
use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::BodyKind;
use sketchnav_schemas::robot::Robot;

use crate::convex::Convex;
use crate::description::WorldDescription;
use crate::drive::Velocity;
use crate::error::SimError;

/// Coefficient of friction between bodies.
const FRICTION: f32 = 0.2;
/// Radius given to shapes that are too thin to have an interior in f32, in metres.
const SLIVER_RADIUS_M: f32 = 5e-4;

/// The bodies of a world.
#[derive(Serialize, Deserialize)]
pub struct Physics {
    rapier: PhysicsWorld,
    robot: RigidBodyHandle,
    robot_collider: ColliderHandle,
    people: Vec<RigidBodyHandle>,
    furniture_count: usize,
}

/// A contact of the robot with a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// Index of the body: 0 for the building, then the furniture, then the people.
    pub body: usize,
    /// Position of the contact, in metres, in frame `World`.
    pub place: Vector2<f64>,
    /// Impulse during the last step, in N·s.
    pub impulse_ns: f64,
}

/// A pose in the precision of rapier. It defines the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruePose {
    /// Position, in metres, in frame `World`.
    pub at: Vector2<f64>,
    /// Heading, in radians, counter-clockwise.
    pub yaw_rad: f64,
}

impl Physics {
    /// Creates the bodies of a world, with the robot at `start`.
    ///
    /// # Errors
    /// [`SimError::Start`] if the robot does not fit there.
    pub fn new(
        world: &WorldDescription,
        robot: &Robot,
        start: TruePose,
        dt_s: f64,
    ) -> Result<Self, SimError> {
        let mut rapier = PhysicsWorld::new();
        rapier.gravity = Vector::ZERO;
        rapier.integration_parameters.dt = dt_s as f32;
        // Touches are derived from contacts, so a contact from an earlier step must not be reused.
        rapier.integration_parameters.contact_recycling = false;
        for solid in &world.walls {
            rapier.insert_collider(fixed(solid, 0), None);
        }
        for (i, solid) in world.furniture.iter().enumerate() {
            rapier.insert_collider(fixed(solid, i + 1), None);
        }
        let furniture_count = world.furniture.len();
        let solids = rapier.colliders.iter().map(|(_, collider)| collider);
        check_start(solids, furniture_count, robot, start)?;
        let first_person = furniture_count + 1;
        let people = world.people.iter().enumerate();
        let people = people.map(|(i, person)| {
            let body =
                RigidBodyBuilder::kinematic_position_based().translation(vector(person.waypoints[0].into()));
            rapier.insert(body, disc(person.radius_m, first_person + i)).0
        });
        let people = people.collect();
        let body = RigidBodyBuilder::dynamic()
            .translation(vector(start.at))
            .rotation(start.yaw_rad as f32)
            .can_sleep(false);
        let (robot, robot_collider) = rapier.insert(body, of_robot(robot).mass(robot.mass_kg as f32));
        rapier.detect_collisions(&(), &());
        Ok(Self { rapier, robot, robot_collider, people, furniture_count })
    }

    /// Returns the number of bodies that can be touched.
    pub fn body_count(&self) -> usize {
        1 + self.furniture_count + self.people.len()
    }

    /// Returns the kind of a body, given its index.
    pub fn kind(&self, body: usize) -> BodyKind {
        kind(body, self.furniture_count)
    }

    /// Returns the pose of the robot.
    pub fn robot_pose(&self) -> TruePose {
        let body = &self.rapier.bodies[self.robot];
        TruePose { at: vector2(body.translation()), yaw_rad: f64::from(body.rotation().angle()) }
    }

    /// Returns the velocity of the robot.
    pub fn robot_velocity(&self) -> Velocity {
        let body = &self.rapier.bodies[self.robot];
        Velocity { linear: vector2(body.linvel()), angular: f64::from(body.angvel()) }
    }

    /// Sets the target velocity of the robot's drive. Contacts may reduce the actual velocity.
    pub fn set_robot_velocity(&mut self, velocity: Velocity) {
        let body = &mut self.rapier.bodies[self.robot];
        body.set_linvel(vector(velocity.linear), true);
        body.set_angvel(velocity.angular as f32, true);
    }

    /// Checks that the robot fits at a pose, apart from people.
    ///
    /// # Errors
    /// [`SimError::Start`] if it does not.
    pub fn check_free(&self, robot: &Robot, at: TruePose) -> Result<(), SimError> {
        let count = self.furniture_count;
        let colliders = self.rapier.colliders.iter().map(|(_, collider)| collider);
        let solids = colliders.filter(|collider| collider.user_data as usize <= count);
        check_start(solids, count, robot, at)
    }

    /// Sets the robot down at a pose, at rest.
    pub fn put_robot(&mut self, at: TruePose) {
        let body = &mut self.rapier.bodies[self.robot];
        body.set_position(Pose::new(vector(at.at), at.yaw_rad as f32), true);
        self.set_robot_velocity(Velocity { linear: Vector2::zeros(), angular: 0.0 });
    }

    /// Sets the position that a person will have at the end of the next step.
    pub fn move_person(&mut self, person: usize, to: Vector2<f64>) {
        self.rapier.bodies[self.people[person]].set_next_kinematic_translation(vector(to));
    }

    /// Advances by one step. The length of a step was given when the bodies were created.
    pub fn step(&mut self) {
        self.rapier.step();
    }

    /// Returns the robot's contacts after a step.
    pub fn touching(&self) -> impl Iterator<Item = Touching> + '_ {
        let pairs = self.rapier.narrow_phase.contact_pairs_with(self.robot_collider);
        pairs.filter_map(|pair| self.touch(pair))
    }

    fn touch(&self, pair: &ContactPair) -> Option<Touching> {
        let impulse = pair.total_impulse_magnitude();
        let (_, contact) = pair.find_deepest_contact()?;
        let (first, second) =
            (&self.rapier.colliders[pair.collider1], &self.rapier.colliders[pair.collider2]);
        let other = if pair.collider1 == self.robot_collider { second } else { first };
        let place = first.position().transform_point(contact.local_p1);
        let touching = Touching {
            body: other.user_data as usize,
            place: vector2(place),
            impulse_ns: f64::from(impulse),
        };
        (impulse > 0.0).then_some(touching)
    }
}

fn kind(body: usize, furniture_count: usize) -> BodyKind {
    match body {
        0 => BodyKind::Wall,
        n if n <= furniture_count => BodyKind::Furniture,
        _ => BodyKind::Person,
    }
}

fn check_start<'a>(
    colliders: impl Iterator<Item = &'a Collider>,
    furniture_count: usize,
    robot: &Robot,
    start: TruePose,
) -> Result<(), SimError> {
    let distance = |collider: &Collider| {
        f64::from(collider.shape().distance_to_point(collider.position(), vector(start.at), true))
    };
    let collides = |collider: &Collider| match robot.footprint {
        None => distance(collider) < robot.radius_m,
        Some(_) => overlaps(robot, start, collider),
    };
    let nearest = colliders
        .filter(|collider| collides(collider))
        .map(|collider| (distance(collider), collider.user_data as usize))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or(Ok(()), |(distance_m, body)| {
        Err(SimError::Start {
            x_m: start.at.x,
            y_m: start.at.y,
            needed_m: robot.radius_m,
            kind: kind(body, furniture_count),
            distance_m,
        })
    })
}

/// Returns true if the robot's footprint at `start` overlaps a collider.
fn overlaps(robot: &Robot, start: TruePose, collider: &Collider) -> bool {
    let pose = Pose::new(vector(start.at), start.yaw_rad as f32);
    let footprint = of_robot(robot).build();
    // All shapes here are convex, so parry can compare any two.
    query::intersection_test(&pose, footprint.shape(), collider.position(), collider.shape())
        .map_or(true, |found| found.intersecting)
}

fn fixed(solid: &Convex, body: usize) -> ColliderBuilder {
    let corners: Vec<_> = solid.corners().iter().map(|c| vector((*c).into())).collect();
    // Corners that coincide in f32 do not make an edge, and the rest may be a sliver without an interior.
    let shape = SharedShape::convex_polyline(corners.clone())
        .or_else(|| SharedShape::convex_polyline(distinct(&corners)))
        .unwrap_or_else(|| sliver(&corners));
    ColliderBuilder::new(shape).friction(FRICTION).user_data(body as u128)
}

/// Returns the corners without consecutive duplicates.
fn distinct(corners: &[Vector]) -> Vec<Vector> {
    let mut distinct = corners.to_vec();
    distinct.dedup();
    while distinct.len() > 1 && distinct.first() == distinct.last() {
        distinct.pop();
    }
    distinct
}

/// Returns a capsule along the longest line between two of the corners.
fn sliver(corners: &[Vector]) -> SharedShape {
    let farthest = |from: Vector| {
        let far = corners.iter().max_by(|a, b| (**a - from).length().total_cmp(&(**b - from).length()));
        far.copied().unwrap_or(from)
    };
    let end = farthest(corners[0]);
    SharedShape::capsule(end, farthest(end), SLIVER_RADIUS_M)
}

/// Returns the robot's footprint.
fn of_robot(robot: &Robot) -> ColliderBuilder {
    let shape = match robot.footprint {
        None => SharedShape::ball(robot.radius_m as f32),
        Some(footprint) => {
            SharedShape::cuboid(footprint.length_m as f32 / 2.0, footprint.width_m as f32 / 2.0)
        }
    };
    ColliderBuilder::new(shape).friction(FRICTION).user_data(usize::MAX as u128)
}

fn disc(radius_m: f64, body: usize) -> ColliderBuilder {
    ColliderBuilder::ball(radius_m as f32).friction(FRICTION).user_data(body as u128)
}

fn vector(v: Vector2<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32)
}

fn vector2(v: Vector) -> Vector2<f64> {
    Vector2::new(f64::from(v.x), f64::from(v.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten kilometres from the origin, two corners a tenth of a millimetre apart coincide in f32, and a wall of a millimetre
    /// has no interior. `parry` panics if it has to find the hull of points that all coincide.
    #[test]
    fn a_solid_too_thin_for_single_precision_becomes_a_line() {
        let far = 9_999.0;
        let solids = [
            Convex::rectangle([far, far], [1e-4, 1e-4], 0.3),
            Convex::rectangle([far, 0.0], [1e-4, 8.0], 0.0),
            Convex::rectangle([0.0, far], [8.0, 1e-4], 0.0),
            Convex::disc([far, far], 0.001),
            Convex::disc([far, far], 0.01),
        ];
        for solid in solids {
            let built = fixed(&solid, 0).build();
            let size = built.compute_aabb().extents();
            let [low, high] = [f32::min, f32::max]
                .map(|pick| solid.corners().iter().map(|c| c[1] as f32).reduce(pick).unwrap());
            assert!(size.x.is_finite() && size.y <= high - low + 0.004, "{size:?}");
        }
    }
}
