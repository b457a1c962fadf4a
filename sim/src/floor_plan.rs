//! Vector floor plans: walls with a thickness along their centre lines, and gaps for doors.
//!
//! A wall extends beyond its ends by half its thickness, so that walls that meet at a point close the corner. At a door, it
//! ends flush.

use sketchnav_schemas::bounds;
use sketchnav_schemas::floor_plan::{FloorPlan, Segment, Wall, direction};
use sketchnav_schemas::toml_text;

use crate::convex::Convex;
use crate::description::WorldDescription;
use crate::error::{SimError, check, check_within};

/// Reads a floor plan in TOML and builds it.
///
/// # Errors
/// [`SimError::Toml`] or [`SimError::Value`], which names the key and what was expected.
pub fn parse(text: &str) -> Result<WorldDescription, SimError> {
    describe(&toml_text::read(text)?)
}

/// Builds a floor plan.
///
/// # Errors
/// [`SimError::Value`], which names the key and what was expected, for example if a wall has only one point,
/// a door is not on any wall, or a piece of furniture has no shape.
pub fn describe(plan: &FloorPlan) -> Result<WorldDescription, SimError> {
    check_plan(plan)?;
    let mut world = WorldDescription { name: plan.name.clone(), ..Default::default() };
    let lines: Vec<Segment> = plan.wall.iter().flat_map(Wall::lines).collect();
    check_doors(plan, &lines)?;
    for line in &lines {
        world.walls.extend(pieces(plan, line));
        check_pieces(world.walls.len())?;
    }
    world.outline = world.walls.iter().flat_map(Convex::edges).collect();
    world.add_furniture(&plan.furniture)?;
    world.add_people(&plan.person)?;
    world.add_markers(&plan.marker)?;
    Ok(world)
}

/// Returns the centre lines of the walls between doors, as a person would draw them, in metres, in frame `World`.
///
/// # Errors
/// Any error of [`describe`].
pub fn middle_lines(plan: &FloorPlan) -> Result<Vec<Segment>, SimError> {
    check_plan(plan)?;
    let lines: Vec<Segment> = plan.wall.iter().flat_map(Wall::lines).collect();
    check_doors(plan, &lines)?;
    // Count the pieces before they are created, since there may be millions.
    let mut count = 0;
    for line in &lines {
        count += plan.stretches(line, 0.0).len();
        check_pieces(count)?;
    }
    Ok(plan.middle_lines())
}

fn check_pieces(count: usize) -> Result<(), SimError> {
    check(count <= bounds::MOST_WALL_PIECES, "wall", "at most 25000 pieces between doors", count)
}

fn check_plan(plan: &FloorPlan) -> Result<(), SimError> {
    check_within("wall_thickness_m", bounds::WALL_THICKNESS_M, &[plan.wall_thickness_m])?;
    check(!plan.wall.is_empty(), "wall", "1 wall or more", plan.wall.len())?;
    let corners: usize = plan.wall.iter().map(|wall| wall.points.len()).sum();
    check(corners <= bounds::MOST_WALL_CORNERS, "wall", "at most 20000 points of all walls", corners)?;
    check(plan.door.len() <= bounds::MOST_DOORS, "door", "at most 1000 doors", plan.door.len())?;
    for (i, wall) in plan.wall.iter().enumerate() {
        let key = format!("wall {}.points", i + 1);
        check(wall.points.len() >= 2, key.as_str(), "2 points or more", wall.points.len())?;
        check_within(key, bounds::COORDINATE_M, wall.points.as_flattened())?;
    }
    Ok(())
}

fn check_doors(plan: &FloorPlan, lines: &[Segment]) -> Result<(), SimError> {
    for (i, door) in plan.door.iter().enumerate() {
        let key = |part: &str| format!("door {}.{part}", i + 1);
        check_within(key("at"), bounds::COORDINATE_M, &door.at)?;
        check_within(key("width_m"), bounds::DOOR_WIDTH_M, &[door.width_m])?;
        let on_a_wall = lines.iter().any(|line| door.gap(line, plan.wall_thickness_m).is_some());
        check(on_a_wall, key("at"), "a point on a wall's line", door.at)?;
    }
    Ok(())
}

/// Returns the pieces of a wall between its doors.
fn pieces(plan: &FloorPlan, line: &Segment) -> Vec<Convex> {
    let (start, along, _) = direction(line);
    let yaw = along.y.atan2(along.x);
    let solid = |[a, b]: [f64; 2]| {
        let middle = start + along * ((a + b) / 2.0);
        Convex::rectangle(middle.into(), [b - a, plan.wall_thickness_m], yaw)
    };
    plan.stretches(line, plan.wall_thickness_m / 2.0).into_iter().map(solid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(extra: &str) -> String {
        let room =
            "name='room'\nwall_thickness_m=0.2\n[[wall]]\nclosed=true\npoints=[[0,0],[4,0],[4,3],[0,3]]\n";
        format!("{room}{extra}")
    }

    fn solid_at(world: &WorldDescription, x: f64, y: f64) -> bool {
        world.walls.iter().any(|wall| {
            wall.edges().all(|[a, b]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) > 0.0)
        })
    }

    #[test]
    fn a_door_opens_only_the_wall_it_lies_on() {
        let world = parse(&plan("[[door]]\nat=[2,0]\nwidth_m=0.9\n")).unwrap();
        assert_eq!(world.walls.len(), 5);
        for (x, solid) in [(1.50, true), (1.56, false), (2.0, false), (2.44, false), (2.46, true)] {
            assert_eq!(solid_at(&world, x, 0.0), solid, "{x}");
        }
        assert!(solid_at(&world, 2.0, 3.0));
    }

    #[test]
    fn a_door_opens_both_copies_of_a_wall() {
        let twice = "[[wall]]\npoints=[[4,0],[0,0]]\n[[door]]\nat=[2,0]\nwidth_m=0.9\n";
        assert!(!solid_at(&parse(&plan(twice)).unwrap(), 2.0, 0.0));
    }

    #[test]
    fn corners_are_closed() {
        let world = parse(&plan("")).unwrap();
        assert!(solid_at(&world, -0.09, -0.09) && solid_at(&world, 4.09, 3.09));
    }

    #[test]
    fn errors_name_the_key() {
        let cases = [
            ("[[door]]\nat=[2,1]\nwidth_m=0.9\n", "door 1.at: expected a point on a wall's line"),
            ("[[door]]\nat=[2,0]\nwidth_m=-1\n", "door 1.width_m: expected 0.01 to 1000 m, found -1"),
            ("[[wall]]\npoints=[[1,1]]\n", "wall 2.points: expected 2 points or more, found 1"),
            ("[[furniture]]\nname='desk'\n", "furniture 1 \"desk\": expected either polygon"),
            ("[[person]]\nwaypoints=[]\nspeed_mps=1\n", "person 1.waypoints: expected 1 waypoint"),
            (
                "[[marker]]\nid=7\nat=[2,1]\nfacing_deg=0\n",
                "marker 1 (id 7).at: expected a place on the face of a wall",
            ),
            (
                "[[marker]]\nid=7\nat=[2,0.1]\nfacing_deg=-90\n",
                "marker 1 (id 7).facing_deg: expected a direction away from the wall or furniture that it is on",
            ),
            (
                "[[marker]]\nid=7\nat=[2,0.1]\nfacing_deg=90\n[[marker]]\nid=7\nat=[3,0.1]\nfacing_deg=90\n",
                "marker 2 (id 7).id: expected a number that no other marker has, found 7",
            ),
            (
                "[[marker]]\nid=7\nat=[nan,0]\nfacing_deg=90\n",
                "marker 1 (id 7).at: expected -10000 to 10000 m",
            ),
            ("[[window]]\n", "unknown field `window`"),
        ];
        for (extra, message) in cases {
            let error = parse(&plan(extra)).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }

    /// In single precision, walls at 1e308 m and furniture at 1e39 m are infinitely far away, and a table of 1e-30 m is a point.
    /// Such numbers used to make the physics panic.
    #[test]
    fn numbers_beyond_any_building_are_refused() {
        let cases = [
            (
                "[[wall]]\npoints=[[0,0],[1e308,0]]\n",
                "wall 2.points: expected -10000 to 10000 m, found 1e308",
            ),
            ("[[wall]]\npoints=[[0,0],[nan,0]]\n", "wall 2.points: expected -10000 to 10000 m, found NaN"),
            (
                "[[furniture]]\nname='desk'\ncenter=[1e39,0]\nradius_m=1\n",
                "furniture 1 \"desk\".center: expected -10000 to 10000 m, found 1e39",
            ),
            (
                "[[furniture]]\ncenter=[1,1]\nsize=[1e-30,1]\n",
                "furniture 1 \"\".size: expected 0.001 to 1000 m, found 1e-30",
            ),
            (
                "[[furniture]]\ncenter=[1,1]\nsize=[1,1]\nyaw_deg=1e300\n",
                "furniture 1 \"\".yaw_deg: expected -360 to 360 degrees, found 1e300",
            ),
            (
                "[[furniture]]\npolygon=[[0,0],[1e-9,0],[0,1e-9]]\n",
                "furniture 1 \"\".polygon: expected the corners of a convex polygon",
            ),
            (
                "[[person]]\nwaypoints=[[1,1]]\nspeed_mps=1e6\n",
                "person 1.speed_mps: expected 0.001 to 30 m/s, found 1000000",
            ),
            (
                "[[person]]\nwaypoints=[[1,1]]\nspeed_mps=1\npause_s=inf\n",
                "person 1.pause_s: expected 0 to 1000000 s, found inf",
            ),
        ];
        for (extra, message) in cases {
            let error = parse(&plan(extra)).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
        // Corners that differ only by rounding used to make a wall without a direction.
        let near = parse(&plan("[[wall]]\npoints=[[1,1],[1,1.0000000000000002],[1e-200,1e-200],[0,0]]\n"));
        assert!(near.unwrap().outline.as_flattened().as_flattened().iter().all(|v| v.is_finite()));
    }

    /// 200,000 walls and 20,000 pieces of furniture on top of each other used to keep the physics busy for minutes.
    #[test]
    fn too_many_elements_are_refused_by_their_count() {
        let cases = [
            (
                "[[wall]]\npoints=[[0,0],[1,0]]\n",
                10_000,
                "wall: expected at most 20000 points of all walls, found 20004",
            ),
            ("[[door]]\nat=[2,0]\nwidth_m=0.9\n", 1001, "door: expected at most 1000 doors, found 1001"),
            (
                "[[furniture]]\ncenter=[1,1]\nsize=[1,1]\n",
                2001,
                "furniture: expected at most 2000 pieces, found 2001",
            ),
            (
                "[[person]]\nwaypoints=[[1,1]]\nspeed_mps=1\n",
                101,
                "person: expected at most 100 people, found 101",
            ),
        ];
        for (one, count, message) in cases {
            let error = parse(&plan(&one.repeat(count))).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
    }

    /// 2000 walls on one line with 1000 doors used to become two million pieces, which took 11 GB and several minutes.
    #[test]
    fn the_number_of_wall_pieces_is_limited() {
        let walls = "[[wall]]\npoints=[[0,1],[4,1]]\n".repeat(90);
        let door = |i: i32| format!("[[door]]\nat=[{},1]\nwidth_m=0.01\n", 0.013 * f64::from(i));
        let text = plan(&(walls + &(1..=300).map(door).collect::<String>()));
        let message = "wall: expected at most 25000 pieces between doors, found 25";
        let error = parse(&text).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
        let error = middle_lines(&toml::from_str(&text).unwrap()).unwrap_err().to_string();
        assert!(error.starts_with(message), "{error}");
    }

    mod any {
        use proptest::prelude::*;
        use proptest::test_runner::RngSeed;

        use super::*;

        /// Numbers as people write them, and numbers that occur by mistake.
        fn number() -> impl Strategy<Value = f64> {
            prop_oneof![4 => -10.0..10.0_f64, 1 => any::<f64>(), 1 => Just(1e39), 1 => Just(1e-30), 1 => Just(0.0)]
        }

        fn point() -> impl Strategy<Value = [f64; 2]> {
            [number(), number()]
        }

        proptest! {
            #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]

            #[test]
            fn no_text_makes_it_panic(text in ".*") {
                let _ = parse(&text);
            }

            #[test]
            fn built_walls_are_finite_in_single_precision(
                points in prop::collection::vec(point(), 2..5), center in point(), size in point(), thickness in number(),
            ) {
                let text = format!(
                    "name='n'\nwall_thickness_m={thickness:?}\n[[wall]]\npoints={points:?}\n[[furniture]]\n\
                     center={center:?}\nsize={size:?}\n"
                );
                if let Ok(world) = parse(&text.replace("NaN", "nan")) {
                    let solids = world.walls.iter().chain(&world.furniture);
                    prop_assert!(solids.flat_map(Convex::corners).flatten().all(|v| (*v as f32).abs() < 1e5));
                }
            }
        }
    }
}
