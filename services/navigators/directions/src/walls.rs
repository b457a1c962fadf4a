//! Walls and furniture, the obstacles of a floor other than its landmarks. They hide landmarks and block the robot. Doors are gaps
//! in walls.
//!
//! All lengths are in the plane's unit, and every obstacle consists of lines with a thickness.

use sketchnav_schemas::floor_plan::{FloorPlan, Furniture};

use crate::geometry::Point;
use crate::sight::bearing_rad;

/// Number of corners of the polygon that approximates a disc.
const DISC_CORNERS: u32 = 16;

/// A line that extends by half its thickness to each side.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    ends: [Point; 2],
    half: f64,
}

/// A straight path, with the limit up to which pieces count as close. Bounding boxes rule out most pieces of a floor quickly.
#[derive(Debug, Clone, Copy)]
struct Strip {
    ends: [Point; 2],
    limit: f64,
}

/// The properties of a robot's body and its laser that matter near walls.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Body {
    /// Radius of the body.
    pub radius: f64,
    /// Distance that the robot's centre keeps from walls whenever possible.
    pub keeps: f64,
    /// Minimum distance in range between a landmark and anything else close to its edge. If they are closer, the laser merges
    /// both into one object, which isn't recognised as a landmark.
    pub merges: f64,
}

/// The walls of a floor. Above a plane, there are none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Walls {
    pieces: Vec<Piece>,
    /// The edges of all pieces, which hide what is behind them, and to which the robot keeps its distance. A piece itself has no
    /// corners: at a door, its line would reach into the opening by half its thickness.
    edges: Vec<Piece>,
    body: Body,
}

impl Walls {
    /// Creates walls along lines with the given thickness.
    pub fn new(lines: impl IntoIterator<Item = [Point; 2]>, thickness: f64, body: Body) -> Self {
        let half = thickness / 2.0;
        let pieces: Vec<_> = lines.into_iter().map(|ends| Piece { ends, half }).collect();
        let edges = pieces.iter().flat_map(Piece::edges).collect();
        Self { pieces, edges, body }
    }

    /// Returns everything that stands on a floor except its landmarks, in metres.
    pub fn of_floor(plan: &FloorPlan, is_landmark: impl Fn(&Furniture) -> bool, body: Body) -> Self {
        let point = |[x, y]: [f64; 2]| Point::new(x, y);
        let lines = plan.middle_lines().into_iter().map(|line| line.map(point));
        let mut walls = Self::new(lines, plan.wall_thickness_m, body);
        let others = plan.furniture.iter().filter(|piece| !is_landmark(piece));
        let furniture = others.flat_map(outline).map(|ends| Piece { ends: ends.map(point), half: 0.0 });
        let furniture: Vec<_> = furniture.collect();
        walls.pieces.extend(&furniture);
        walls.edges.extend(furniture);
        walls
    }

    /// Returns true if there are no walls.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Iterates over the centre lines of all walls.
    pub fn lines(&self) -> impl Iterator<Item = [Point; 2]> + '_ {
        self.pieces.iter().map(|piece| piece.ends)
    }

    /// Returns true if a wall is too close to a straight path.
    pub fn bar(&self, from: Point, to: Point) -> bool {
        let strip = Strip { ends: [from, to], limit: self.body.keeps };
        self.edges.iter().any(|edge| strip.contains(edge))
    }

    /// Returns true if a wall lies across a straight line.
    pub fn cross(&self, from: Point, to: Point) -> bool {
        let strip = Strip { ends: [from, to], limit: 0.0 };
        self.pieces.iter().any(|piece| strip.contains(piece))
    }

    /// Returns true if the robot touches a wall on a short path without moving away from it.
    pub fn touch(&self, from: Point, to: Point) -> bool {
        let strip = Strip { ends: [from, to], limit: self.body.radius };
        self.edges
            .iter()
            .any(|edge| strip.contains(edge) && edge.squared_distance(to) <= edge.squared_distance(from))
    }

    /// Returns true if walls hide any part of a landmark, or if the laser merges it with one. `landmark` is relative to the eye,
    /// and subtends `half_rad` to each side.
    pub fn hide(&self, eye: Point, landmark: Point, half_rad: f64) -> bool {
        let distance = landmark.norm();
        // Considers only what is as near as the landmark, or merges with it, within the angle that it subtends.
        let reach = (distance + self.body.merges) / half_rad.cos().max(0.1);
        let strip = Strip { ends: [eye, eye + landmark * (reach / distance)], limit: reach * half_rad.sin() };
        let near = self.edges.iter().filter(|edge| strip.contains(edge));
        near.map(|piece| piece.ends.map(|end| end - eye)).any(|ends| {
            let merges = |side_rad: f64| {
                range(ends, landmark, side_rad)
                    .is_some_and(|range| (range - distance).abs() <= self.body.merges)
            };
            let [a, b] = ends.map(|end| bearing_rad(landmark, end));
            // A wall that passes behind the eye hides nothing on either side.
            let (from, to) = (a.min(b).max(-half_rad), a.max(b).min(half_rad));
            let covers = (a - b).abs() <= std::f64::consts::PI && from < to;
            let is_nearer = || range(ends, landmark, (from + to) / 2.0).is_some_and(|range| range < distance);
            merges(half_rad) || merges(-half_rad) || (covers && is_nearer())
        })
    }
}

impl Piece {
    /// Returns the edges of this piece.
    fn edges(&self) -> [Self; 4] {
        let [a, b] = self.ends;
        let along = (b - a).direction().unwrap_or_default();
        let aside = Point::new(-along.y, along.x) * self.half;
        let corners = [a - aside, b - aside, b + aside, a + aside];
        [0, 1, 2, 3].map(|i| Self { ends: [corners[i], corners[(i + 1) % 4]], half: 0.0 })
    }

    /// Returns the square of the distance from a point to the line in the middle of this piece.
    fn squared_distance(&self, point: Point) -> f64 {
        let [a, b] = self.ends;
        squared_to_line(point, a, b)
    }
}

impl Strip {
    /// Returns true if some part of a piece is closer to the path than the limit.
    fn contains(&self, piece: &Piece) -> bool {
        let ([from, to], [a, b]) = (self.ends, piece.ends);
        let reach = self.limit + piece.half;
        let is_apart =
            |a: f64, b: f64, c: f64, d: f64| a.min(b) - c.max(d) > reach || c.min(d) - a.max(b) > reach;
        if is_apart(from.x, to.x, a.x, b.x) || is_apart(from.y, to.y, a.y, b.y) {
            return false;
        }
        if cross(to - from, a - from) * cross(to - from, b - from) < 0.0
            && cross(b - a, from - a) * cross(b - a, to - a) < 0.0
        {
            return true;
        }
        let ends = [
            squared_to_line(a, from, to),
            squared_to_line(b, from, to),
            piece.squared_distance(from),
            piece.squared_distance(to),
        ];
        ends.into_iter().fold(f64::INFINITY, f64::min) <= reach * reach
    }
}

/// Returns the distance along a ray to its intersection with a line. The ray's direction is given as an angle to the left of
/// the direction to a landmark.
fn range([a, b]: [Point; 2], landmark: Point, side_rad: f64) -> Option<f64> {
    let way = landmark.direction()?.turned(side_rad);
    let (along, from) = (cross(way, b - a), cross(a, b - a));
    let (range, share) = (from / along, cross(a, way) / along);
    (along != 0.0 && range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
}

fn cross(a: Point, b: Point) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Returns the square of the distance from a point to the nearest point of a line segment.
fn squared_to_line(point: Point, from: Point, to: Point) -> f64 {
    let along = to - from;
    let share =
        if along.norm_squared() > 0.0 { (point - from).dot(along) / along.norm_squared() } else { 0.0 };
    (point - from - along * share.clamp(0.0, 1.0)).norm_squared()
}

/// Returns the edges of a piece of furniture, in metres.
fn outline(piece: &Furniture) -> Vec<[[f64; 2]; 2]> {
    let corners: Vec<[f64; 2]> = match (&piece.polygon, piece.center, piece.size, piece.radius_m) {
        (Some(polygon), ..) => polygon.clone(),
        (None, Some([x, y]), Some([length, width]), _) => {
            let corner = |(along, aside): (f64, f64)| {
                let at =
                    Point::new(along * length / 2.0, aside * width / 2.0).turned(piece.yaw_deg.to_radians());
                [x + at.x, y + at.y]
            };
            [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(corner).to_vec()
        }
        (None, Some([x, y]), None, Some(radius_m)) => {
            let corner = |i| {
                let turn_rad = f64::from(i) * std::f64::consts::TAU / f64::from(DISC_CORNERS);
                [x + radius_m * turn_rad.cos(), y + radius_m * turn_rad.sin()]
            };
            (0..DISC_CORNERS).map(corner).collect()
        }
        _ => Vec::new(),
    };
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| [*a, *b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Body = Body { radius: 0.2, keeps: 0.35, merges: 0.4 };

    fn walls(lines: &[[(f64, f64); 2]]) -> Walls {
        Walls::new(lines.iter().map(|line| line.map(|(x, y)| Point::new(x, y))), 0.1, BODY)
    }

    fn point(x: f64, y: f64) -> Point {
        Point::new(x, y)
    }

    #[test]
    fn a_wall_bars_the_ways_across_it_and_near_it_and_a_gap_is_a_way() {
        let gap = walls(&[[(5.0, -9.0), (5.0, -1.0)], [(5.0, 1.0), (5.0, 9.0)]]);
        assert!(gap.bar(point(0.0, 4.0), point(9.0, 4.0)) && gap.cross(point(0.0, 4.0), point(9.0, 4.0)));
        assert!(!gap.bar(point(0.0, 0.0), point(9.0, 0.5)));
        // The path passes the end of a wall, which is at 1, at a distance of 0.3 or 0.4.
        assert!(gap.bar(point(0.0, 0.7), point(9.0, 0.7)) && !gap.cross(point(0.0, 0.7), point(9.0, 0.7)));
        assert!(!gap.bar(point(0.0, 0.6), point(9.0, 0.6)), "the thickness of a wall lies beside it");
        assert!(gap.bar(point(4.7, 4.0), point(4.7, 8.0)) && !gap.bar(point(4.5, 4.0), point(4.5, 8.0)));
        assert!(!Walls::default().bar(point(0.0, 0.0), point(9.0, 9.0)));
    }

    #[test]
    fn a_robot_that_touches_a_wall_may_leave_it() {
        let wall = walls(&[[(5.0, -9.0), (5.0, 9.0)]]);
        assert!(
            wall.touch(point(4.7, 0.0), point(4.8, 0.0)) && !wall.touch(point(4.6, 0.0), point(4.7, 0.0))
        );
        assert!(!wall.touch(point(4.8, 0.0), point(4.7, 0.0)));
    }

    #[test]
    fn what_stands_on_a_floor_are_its_walls_between_doors_and_its_furniture() {
        let plan: FloorPlan = toml::from_str(
            "name='f'\nwall_thickness_m=0.1\nwall=[{points=[[0,0],[10,0]]}]\ndoor=[{at=[5,0],width_m=2}]\n\
             furniture=[{center=[3,3],radius_m=0.15},{center=[7,3],radius_m=0.5},{center=[5,7],size=[2,1],yaw_deg=90}]\n",
        )
        .unwrap();
        let walls = Walls::of_floor(&plan, |piece| piece.radius_m == Some(0.15), BODY);
        assert_eq!(walls.lines().count(), 2 + DISC_CORNERS as usize + 4);
        let crosses =
            |from: (f64, f64), to: (f64, f64)| walls.cross(point(from.0, from.1), point(to.0, to.1));
        assert!(crosses((2.0, -1.0), (2.0, 1.0)) && !crosses((5.0, -1.0), (5.0, 1.0)), "wall, door");
        assert!(
            !crosses((2.0, 3.0), (4.0, 3.0)) && crosses((6.0, 3.0), (8.0, 3.0)),
            "landmark, another pillar"
        );
        assert!(crosses((5.0, 5.0), (5.0, 9.0)) && !crosses((4.3, 5.0), (4.3, 9.0)), "a box across");
    }
}
