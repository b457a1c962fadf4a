//! Clutter and people that are in the world but not in any drawing, placed at random.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use sketchnav_schemas::floor_plan::{Furniture, Person};
use sketchnav_schemas::seed;
use sketchnav_sim::convex::Convex;
use sketchnav_sim::scenes::distance;

use crate::experiments::ground::Ground;
use crate::experiments::trial::Trial;

/// Minimum and maximum side length, in metres, of a piece of clutter such as a bin, a chair or a trolley.
const SIDES_M: [f64; 2] = [0.25, 0.6];
/// Minimum distance of clutter and people from the robot's start and from the goal, in metres.
const FREE_M: f64 = 0.8;
/// Number of positions that are tried for each piece.
const TRIES: usize = 50;
/// Minimum and maximum walking speed of people, the minimum length of their walks, and the spacing of the points on their paths.
const SPEEDS_MPS: [f64; 2] = [0.5, 1.1];
const LEAST_WALK_M: f64 = 4.0;
const STRIDE_M: f64 = 0.5;
const RADIUS_M: f64 = 0.25;

/// Returns pieces of clutter, placed one after another so that a path to the goal remains. If `ground` has no space for more, there
/// are fewer than `count`. With a smaller `count`, the first of the same pieces are returned.
pub fn clutter(ground: &Ground, trial: &Trial, count: usize) -> Vec<Furniture> {
    let mut rng = stream(trial, "clutter");
    let mut ground = ground.clone();
    let [start, goal] = ends(trial);
    let Some(mut way) = ground.way(start, goal) else { return Vec::new() };
    let mut put = Vec::new();
    for _ in 0..count * TRIES {
        if put.len() == count {
            break;
        }
        let piece = piece(&ground, &mut rng);
        let Some((solid, piece)) = piece.filter(|(_, piece)| is_apart(piece, [start, goal])) else {
            continue;
        };
        let mut fuller = ground.clone();
        fuller.put(&solid);
        if !way.iter().all(|&at| ground.clears(&solid, at)) {
            let Some(around) = fuller.way(start, goal) else { continue };
            way = around;
        }
        ground = fuller;
        put.push(piece);
    }
    put
}

fn piece(ground: &Ground, rng: &mut Pcg64Mcg) -> Option<(Convex, Furniture)> {
    let center = place(ground, rng)?;
    let size = [(); 2].map(|()| rng.random_range(SIDES_M[0]..SIDES_M[1]));
    let yaw_deg: f64 = rng.random_range(0.0..180.0);
    let solid = Convex::rectangle(center, size, yaw_deg.to_radians());
    let piece = Furniture {
        name: "clutter".into(),
        polygon: None,
        center: Some(center),
        size: Some(size),
        yaw_deg,
        radius_m: None,
    };
    Some((solid, piece))
}

fn is_apart(piece: &Furniture, places: [[f64; 2]; 2]) -> bool {
    piece.center.is_some_and(|at| places.iter().all(|place| distance(at, *place) > FREE_M))
}

/// Returns people who walk back and forth between positions on the floor. With a smaller `count`, the first of the same people are
/// returned.
pub fn walkers(ground: &Ground, trial: &Trial, count: usize) -> Vec<Person> {
    let mut rng = stream(trial, "walkers");
    let [start, _] = ends(trial);
    (0..count * TRIES).filter_map(|_| walker(ground, start, &mut rng)).take(count).collect()
}

fn walker(ground: &Ground, robot: [f64; 2], rng: &mut Pcg64Mcg) -> Option<Person> {
    let (from, to) = (place(ground, rng)?, place(ground, rng)?);
    let speed_mps = rng.random_range(SPEEDS_MPS[0]..SPEEDS_MPS[1]);
    if distance(from, robot) < 2.0 * FREE_M || distance(from, to) < LEAST_WALK_M {
        return None;
    }
    let way = ground.way(from, to)?;
    let mut waypoints = vec![way[0]];
    for &at in &way[1..] {
        if distance(at, waypoints[waypoints.len() - 1]) >= STRIDE_M {
            waypoints.push(at);
        }
    }
    Some(Person { waypoints, speed_mps, radius_m: RADIUS_M, pause_s: 0.0 })
}

fn place(ground: &Ground, rng: &mut Pcg64Mcg) -> Option<[f64; 2]> {
    let count = ground.places().count();
    if count == 0 { None } else { ground.places().nth(rng.random_range(0..count)) }
}

fn ends(trial: &Trial) -> [[f64; 2]; 2] {
    [trial.mission.start.world, trial.mission.task[0].there.middle()]
}

fn stream(trial: &Trial, what: &str) -> Pcg64Mcg {
    seed::stream(1, &format!("eval/{what}/{}", trial.name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::deformed;
    use crate::experiments::suite::Folders;

    #[test]
    fn clutter_leaves_a_path_and_more_clutter_contains_the_first() {
        let sites = deformed::shipped(&Folders::of_checkout()).unwrap();
        let trial = sites[1].trials(0.5, 1).unwrap().remove(0);
        let mut ground = sites[1].ground.clone();
        let many = clutter(&ground, &trial, 15);
        assert_eq!((many.len(), &many[..5]), (15, &clutter(&ground, &trial, 5)[..]));
        for piece in &many {
            ground.put(&Convex::rectangle(
                piece.center.unwrap(),
                piece.size.unwrap(),
                piece.yaw_deg.to_radians(),
            ));
        }
        let [start, goal] = ends(&trial);
        assert!(ground.way(start, goal).is_some());
        let walking = walkers(&sites[1].ground, &trial, 3);
        assert_eq!((walking.len(), &walking[..1]), (3, &walkers(&sites[1].ground, &trial, 1)[..]));
    }
}
