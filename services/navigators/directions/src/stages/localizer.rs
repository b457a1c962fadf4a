//! The localizer, which describes the view once per tick: how isolated each dot is, what surrounds it, and which dot each word
//! refers to (Park and Kender 1995, 5.6 and 6.3.1).
//!
//! On land, markers in the camera's view identify the kinds of the landmarks beside them.
//!
//! The localizer has no memory, so it never finds a dot for the word `New`.

use arrayvec::ArrayVec;
use serde::Serialize;
use sketchnav_schemas::channels::{MARKERS, SCAN, VIEW};
use sketchnav_schemas::message::{DotView, Header, MAX_DOTS, MarkerView};
use sketchnav_schemas::run::RunConfig;
use sketchnav_stage::{Denied, Instant, Outbox, Stage, StageError};

use super::error::DirectionsError;
use super::mission::DirectionsMission;
use super::settings;
use crate::description::Descriptor;
use crate::geometry::{Corner, Point, Window};
use crate::isolation::c_value;
use crate::markers::reach_m;
use crate::messages::{DESCRIPTION, DescribedDot, Description};
use crate::navigator::tracks::nearest;
use crate::pillars::Finder;
use crate::signature::Signature;

/// The dots in view, with the header of the message that showed them.
type Seen = (Header, ArrayVec<Point, MAX_DOTS>);

/// The localizer of a run.
pub struct Localizer {
    window: Window,
    /// Finds landmarks in laser scans, on land only.
    finder: Option<Finder>,
    /// The markers of each kind, in the order of the kinds.
    markers: Vec<Vec<u32>>,
}

impl Localizer {
    /// Creates a localizer with the window of the run's robot and, on land, its laser.
    ///
    /// # Errors
    /// [`DirectionsError`] if the robot lacks the sensor.
    pub fn new(run: &RunConfig) -> Result<Self, DirectionsError> {
        let (window, _) = settings::sight(&run.mission, &run.robot)?;
        let markers = DirectionsMission::of(&run.mission)?.markers.into_values().collect();
        Ok(Self { window, finder: settings::finder(&run.mission, &run.robot)?, markers })
    }
}

impl Localizer {
    /// Returns the dots in view, or `None` before the first view.
    fn seen(&self, instant: &Instant<'_>) -> Result<Option<Seen>, Denied> {
        let Some(finder) = &self.finder else {
            let seen = |view: &DotView| {
                let dots = view.dots().iter().map(|dot| Point::new(dot.x_m.into(), dot.y_m.into()));
                (view.header, dots.collect())
            };
            return Ok(instant.newest(VIEW)?.map(seen));
        };
        Ok(instant.newest(SCAN)?.map(|scan| (scan.header, finder.find(scan))))
    }

    /// Sets the kinds of the dots according to the markers in view. Each marker belongs to the nearest landmark within reach.
    fn tell_kinds(&self, view: &MarkerView, dots: &[Point], description: &mut Description) {
        let reach_m = reach_m(self.finder.map_or(0.0, |finder| finder.radius_m));
        for marker in view.markers() {
            let Some(kind) = self.markers.iter().position(|numbers| numbers.contains(&marker.id)) else {
                continue;
            };
            if let Some(own) = nearest(dots, Point::new(marker.x_m.into(), marker.y_m.into()), reach_m) {
                description.dots[own].kind = kind as u32 + 1;
            }
        }
    }
}

/// Describes the view. Sets all fields except the header, the time and the number of the view.
pub fn describe(dots: &[Point], window: Window, description: &mut Description) {
    let inside: ArrayVec<usize, MAX_DOTS> =
        (0..dots.len()).filter(|&index| window.shows(dots[index])).collect();
    let shown: ArrayVec<Point, MAX_DOTS> = inside.iter().map(|&index| dots[index]).collect();
    description.dot_count = dots.len() as u32;
    for (place, &dot) in description.dots.iter_mut().zip(dots) {
        let quadrants = signature(dots, dot, window);
        *place = DescribedDot { x_m: dot.x as f32, y_m: dot.y as f32, isolation: 0, quadrants, kind: 0 };
    }
    for (rank, &index) in inside.iter().enumerate() {
        description.dots[index].isolation = c_value(&shown, rank).unwrap_or(0);
    }
    for (meant, word) in description.meant.iter_mut().zip(Descriptor::ALL) {
        let picked = if word == Descriptor::New { None } else { word.pick(&shown) };
        *meant = picked.map_or(0, |rank| inside[rank] as u32 + 1);
    }
}

/// Returns the quadrants of a dot that hold another dot in view, one bit each.
fn signature(dots: &[Point], own: Point, window: Window) -> u32 {
    let mut signature = Signature::default();
    for relative in dots.iter().map(|&dot| dot - own).filter(|relative| *relative != Point::default()) {
        let held = Corner::ALL.into_iter().filter(|quadrant| quadrant.covers(relative, window.side));
        held.for_each(|quadrant| signature.occupy(quadrant));
    }
    (0..).zip(Corner::ALL).map(|(bit, corner)| u32::from(signature.has(corner)) << bit).sum()
}

impl Stage for Localizer {
    const FORM: &'static str = "directions localizer 2";
    type State = ();

    fn step(&mut self, instant: &Instant<'_>, out: &mut Outbox<'_>) -> Result<(), StageError> {
        let seen = self.seen(instant)?;
        let markers = if self.markers.is_empty() { None } else { instant.newest(MARKERS)? };
        out.send(DESCRIPTION, |description| {
            if let Some((header, dots)) = seen {
                (description.views, description.view_stamp_ns) = (header.seq, header.stamp_ns);
                describe(&dots, self.window, description);
                markers.into_iter().for_each(|view| self.tell_kinds(view, &dots, description));
            }
        })?;
        Ok(())
    }

    fn state(&self) -> impl Serialize {}

    fn restore(&mut self, (): ()) -> Result<(), StageError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use sketchnav_schemas::geometry::Pose;
    use sketchnav_schemas::message::Message;

    /// Marker 7 is on the second landmark, marker 8 is far from both, and marker 3 is not in the mission.
    #[test]
    fn a_marker_shows_the_kind_of_the_landmark_beside_it() {
        let finder = Finder { radius_m: 0.15, range_m: 8.0, noise_m: 0.03, mount: Pose::new(0.0, 0.0, 0.0) };
        let window = Window::new(16.0, 0.0).unwrap();
        let localizer = Localizer { window, finder: Some(finder), markers: vec![vec![8], vec![7]] };
        let dots = [Point::new(2.0, 0.0), Point::new(0.0, 3.0)];
        let mut description = Description::zeroed();
        describe(&dots, window, &mut description);
        let mut view = MarkerView::zeroed();
        let seen = [(3, 1.9, 0.1), (7, 0.1, 2.8), (8, 4.0, 4.0)];
        view.marker_count = seen.len() as u32;
        for (marker, (id, x_m, y_m)) in view.markers.iter_mut().zip(seen) {
            (marker.id, marker.x_m, marker.y_m) = (id, x_m, y_m);
        }
        localizer.tell_kinds(&view, &dots, &mut description);
        assert_eq!([0, 1].map(|dot: usize| description.dots[dot].kind), [0, 2]);
    }

    /// A view with a pair of dots near the middle, a single dot, and one in the margin.
    #[test]
    fn a_view_is_described() {
        let dots = [(0.0, 0.0), (0.01, 0.0), (-0.04, -0.04), (0.06, 0.0)].map(|(x, y)| Point::new(x, y));
        let mut description = Description::zeroed();
        describe(&dots, Window::new(0.1, 0.015).unwrap(), &mut description);
        assert!(description.is_valid());
        let means =
            |word: Descriptor| description.meant[Descriptor::ALL.iter().position(|w| *w == word).unwrap()];
        assert_eq!(means(Descriptor::Any), 1, "the closest to the middle");
        assert_eq!(means(Descriptor::Isolated), 3);
        assert_eq!((means(Descriptor::Obvious), means(Descriptor::New)), (0, 0));
        assert_eq!(description.dots[3].isolation, 0, "in the margin");
        // One dot lies south-west of the middle dot. Two lie due east of it, on an axis, so they count for two quadrants.
        let own = |bit: u32| description.dots[0].quadrants >> bit & 1;
        assert_eq!([own(0), own(1), own(2), own(3)], [0, 1, 1, 1]);
    }
}
