//! Fields of poles: identical upright cylinders at random positions, far from any wall. They are used to test directions on land
//! (Park and Kender 1995, 8).

use rand::RngExt;
use sketchnav_schemas::floor_plan::{FloorPlan, Furniture, Wall};
use sketchnav_schemas::seed;

/// Radius of a pole, in metres.
pub const RADIUS_M: f64 = 0.15;
/// Side length of a field, in metres.
pub const SIDE_M: f64 = 36.0;
/// Number of poles in a field.
pub const POLES: usize = 100;
/// Minimum distance between two poles, in metres. A robot can pass between them.
const APART_M: f64 = 1.6;
/// Distance from the field to the walls around it, in metres, which exceeds the range of the robots.
const AROUND_M: f64 = 15.0;

/// Returns the poles of the field with the given number, starting with the one nearest to the south-west corner.
pub fn poles(number: u64) -> Vec<[f64; 2]> {
    let mut rng = seed::stream(number, "poles");
    let mut poles: Vec<[f64; 2]> = Vec::with_capacity(POLES);
    while poles.len() < POLES {
        let place = [rng.random_range(0.0..SIDE_M), rng.random_range(0.0..SIDE_M)].map(to_centimetres);
        if poles.iter().all(|pole| (pole[0] - place[0]).hypot(pole[1] - place[1]) >= APART_M) {
            poles.push(place);
        }
    }
    poles.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    poles
}

fn to_centimetres(at_m: f64) -> f64 {
    (at_m * 100.0).round() / 100.0
}

/// Returns poles as furniture on a floor.
pub fn furniture(poles: &[[f64; 2]]) -> Vec<Furniture> {
    let stand = |&center: &[f64; 2]| Furniture {
        name: "pole".to_owned(),
        polygon: None,
        center: Some(center),
        size: None,
        yaw_deg: 0.0,
        radius_m: Some(RADIUS_M),
    };
    poles.iter().map(stand).collect()
}

/// Returns the floor plan of a field, with walls far around it.
pub fn plan(number: u64) -> FloorPlan {
    let (low, high) = (-AROUND_M, SIDE_M + AROUND_M);
    FloorPlan {
        name: format!("field of poles {number}"),
        wall_thickness_m: 0.1,
        wall: vec![Wall { points: vec![[low, low], [high, low], [high, high], [low, high]], closed: true }],
        door: Vec::new(),
        furniture: furniture(&poles(number)),
        person: Vec::new(),
        marker: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_two_poles_of_a_field_leave_room_for_a_robot() {
        for number in 1..20 {
            let poles = poles(number);
            assert_eq!(poles.len(), POLES);
            for (i, a) in poles.iter().enumerate() {
                assert!(a.iter().all(|at| (0.0..=SIDE_M).contains(at)));
                assert!(poles[..i].iter().all(|b| (a[0] - b[0]).hypot(a[1] - b[1]) >= APART_M));
            }
        }
        assert_ne!(poles(1), poles(2));
    }

    #[test]
    fn a_field_is_a_floor_that_can_be_read() {
        let text = toml::to_string(&plan(3)).unwrap();
        let world = crate::floor_plan::parse(&text).unwrap();
        assert_eq!(world.furniture.len(), POLES);
    }
}
