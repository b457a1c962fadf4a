//! Trajectories, in which the window slides along the line through two landmarks until a third one comes into view (Park and
//! Kender 1995, 4.4 to 4.6).
//!
//! The window is first centred on the pair (figure 10), and dots already visible then do not count as new. The search proceeds
//! strip by strip, so it examines little more than the area that the window sweeps over.

use crate::geometry::{Point, Window};
use crate::plane::{DotId, Plane};

/// A slide of the window from a start position in a direction of length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slide {
    /// Position of the window's centre at the beginning.
    pub from: Point,
    /// Direction of the slide, of length 1.
    pub along: Point,
}

/// The end of a slide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Landing {
    /// The first dot that comes into the window.
    pub dot: DotId,
    /// Distance slid until the dot comes in.
    pub distance: f64,
}

impl Slide {
    /// Returns the slide that starts midway between two landmarks and leads from the first towards the second or, if
    /// `backwards` is set, in the opposite direction. Returns `None` if both have the same position.
    pub fn of_pair(first: Point, second: Point, backwards: bool) -> Option<Self> {
        let along = (second - first).direction()?;
        Some(Self { from: (first + second) * 0.5, along: if backwards { -along } else { along } })
    }

    /// Returns the same slide, shifted to the left by a distance.
    pub fn moved_aside(self, by: f64) -> Self {
        Self { from: self.from + Point::new(-self.along.y, self.along.x) * by, ..self }
    }

    /// Returns the same slide, starting farther ahead by a distance.
    pub fn moved_along(self, by: f64) -> Self {
        Self { from: self.from + self.along * by, ..self }
    }

    /// Returns the distances slid until a point enters the window and until it leaves, or `None` if it never enters.
    pub fn span(self, window: Window, point: Point) -> Option<(f64, f64)> {
        let relative = point - self.from;
        let half = window.side / 2.0;
        let (in_x, out_x) = passes(relative.x, self.along.x, half);
        let (in_y, out_y) = passes(relative.y, self.along.y, half);
        let (enters, leaves) = (in_x.max(in_y), out_x.min(out_y));
        (enters <= leaves).then_some((enters, leaves))
    }

    /// Returns the distance slid until a point enters the window, or `None` if it never does or is in the window from the
    /// beginning.
    pub fn meets(self, window: Window, point: Point) -> Option<f64> {
        self.span(window, point).map(|(enters, _)| enters).filter(|&enters| enters > 0.0)
    }

    /// Returns the dot that a slide attains, or `None` if the window leaves the plane first. If two dots enter at once, the one
    /// nearer to the line counts.
    pub fn lands(self, plane: &Plane, window: Window) -> Option<Landing> {
        let reach = self.leaves(plane, window)?;
        let mut begin = 0.0;
        while begin < reach {
            // Each strip is as long as all previous ones together, so an empty plane is crossed in few strips.
            let end = f64::max(2.0 * begin, begin + window.side);
            if let Some(landing) = self.lands_within(plane, window, begin, end) {
                return Some(landing);
            }
            begin = end;
        }
        None
    }

    /// Returns the first dot that enters the window within a strip of the slide.
    fn lands_within(self, plane: &Plane, window: Window, begin: f64, end: f64) -> Option<Landing> {
        let (a, b) = (self.from + self.along * begin, self.from + self.along * end);
        let half = Point::new(window.side / 2.0, window.side / 2.0);
        let low = Point::new(a.x.min(b.x), a.y.min(b.y)) - half;
        let high = Point::new(a.x.max(b.x), a.y.max(b.y)) + half;
        let met = plane.within(low, high).filter_map(|(dot, at)| {
            let distance = self.meets(window, at)?;
            (distance <= end).then_some((self.aside(at), Landing { dot, distance }))
        });
        let order = |a: &(f64, Landing), b: &(f64, Landing)| {
            a.1.distance.total_cmp(&b.1.distance).then(a.0.total_cmp(&b.0)).then(a.1.dot.cmp(&b.1.dot))
        };
        met.min_by(order).map(|(_, landing)| landing)
    }

    /// Returns the distance of a point from the line.
    fn aside(self, point: Point) -> f64 {
        let relative = point - self.from;
        (relative.x * self.along.y - relative.y * self.along.x).abs()
    }

    /// Returns the distance slid after which no dot of the plane can enter the window, or `None` if none ever can.
    fn leaves(self, plane: &Plane, window: Window) -> Option<f64> {
        let (low, high) = plane.bounds_with_margin(window.side / 2.0);
        let span = |low: f64, high: f64, from: f64, along: f64| {
            passes((low + high) / 2.0 - from, along, (high - low) / 2.0).1
        };
        let reach = span(low.x, high.x, self.from.x, self.along.x).min(span(
            low.y,
            high.y,
            self.from.y,
            self.along.y,
        ));
        (reach > 0.0).then_some(reach)
    }
}

/// Returns the distances at which a point at `relative` comes within `half` of a window that moves by `along`, and at which it
/// leaves.
fn passes(relative: f64, along: f64, half: f64) -> (f64, f64) {
    if along == 0.0 {
        return if relative.abs() <= half {
            (f64::NEG_INFINITY, f64::INFINITY)
        } else {
            (f64::INFINITY, f64::NEG_INFINITY)
        };
    }
    let (a, b) = ((relative - half) / along, (relative + half) / along);
    (a.min(b), a.max(b))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{config, plane};

    fn window() -> Window {
        Window::new(10.0, 0.0).unwrap()
    }

    /// Figure 10: two landmarks, with one goal ahead of them and one behind.
    #[test]
    fn a_pair_has_a_goal_in_each_direction() {
        let world = plane(&[(50.0, 50.0), (54.0, 50.0), (80.0, 53.0), (10.0, 46.0), (80.0, 56.0)]);
        let ahead =
            Slide::of_pair(world.dot(0), world.dot(1), false).unwrap().lands(&world, window()).unwrap();
        // The window's edge starts at 52 + 5, and the goal is at 80.
        assert_eq!(ahead, Landing { dot: 2, distance: 23.0 });
        let behind =
            Slide::of_pair(world.dot(0), world.dot(1), true).unwrap().lands(&world, window()).unwrap();
        assert_eq!(behind, Landing { dot: 3, distance: 37.0 });
    }

    #[test]
    fn what_the_window_shows_at_first_is_not_new() {
        let world = plane(&[(50.0, 50.0), (54.0, 50.0), (56.0, 52.0), (70.0, 50.0)]);
        let landing =
            Slide::of_pair(world.dot(0), world.dot(1), false).unwrap().lands(&world, window()).unwrap();
        assert_eq!(landing.dot, 3);
    }

    /// The camera's error shifts the window, which may therefore show fewer dots at first than the map says, or more.
    #[test]
    fn a_slide_that_begins_elsewhere_attains_what_lies_at_the_edge_of_its_window() {
        let world = plane(&[(50.0, 50.0), (54.0, 50.0), (56.9, 52.0), (70.0, 50.0)]);
        let slide = Slide::of_pair(world.dot(0), world.dot(1), false).unwrap();
        let lands = |by| slide.moved_along(by).lands(&world, window()).unwrap().dot;
        assert_eq!((lands(0.0), lands(-0.2)), (3, 2));
    }

    #[test]
    fn a_slide_out_of_the_world_attains_nothing() {
        let world = plane(&[(50.0, 50.0), (54.0, 52.0), (10.0, 46.0)]);
        assert_eq!(Slide::of_pair(world.dot(0), world.dot(1), false).unwrap().lands(&world, window()), None);
        assert_eq!(Slide::of_pair(world.dot(0), world.dot(0), false), None);
    }

    #[test]
    fn a_void_of_a_million_windows_is_crossed_at_once() {
        let world = plane(&[(0.0, 0.0), (4.0, 3.0), (4e8, 3e8), (-1e9, -1e9)]);
        let landing =
            Slide::of_pair(world.dot(0), world.dot(1), false).unwrap().lands(&world, window()).unwrap();
        assert_eq!(landing.dot, 2);
    }

    proptest! {
        #![proptest_config(config(96))]

        #[test]
        fn strips_find_what_a_scan_of_the_world_finds(
            places in prop::collection::btree_set((0_i32..100, 0_i32..100), 3..40),
            backwards: bool,
        ) {
            let pairs: Vec<_> = places.iter().map(|&(x, y)| (f64::from(x), f64::from(y))).collect();
            let world = plane(&pairs);
            let slide = Slide::of_pair(world.dot(0), world.dot(1), backwards).unwrap();
            let scanned = world.dots().iter().filter_map(|&dot| slide.meets(window(), dot)).min_by(f64::total_cmp);
            prop_assert_eq!(slide.lands(&world, window()).map(|landing| landing.distance), scanned);
        }
    }
}
