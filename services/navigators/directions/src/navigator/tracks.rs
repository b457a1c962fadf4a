//! Follows dots from view to view by their expected positions.
//!
//! Dots stand still, so when the window moves, all of them shift alike in the view. A dot at a position where none is expected is
//! new, and a dot that is missed is assumed to be at its expected position for a while.

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::view::View;
use crate::description::MOST_CANDIDATES;
use crate::geometry::{Point, Window};
use crate::markers::LandmarkKind;

/// Number of consecutive misses after which a dot outside the window proper is forgotten.
const MOST_MISSED: u8 = 3;

/// A dot that is followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Position of the dot, relative to the window's centre.
    pub place: Point,
    /// Number of views in which the dot was seen.
    pub seen: u8,
    /// Number of consecutive views, up to the last, in which it was missed.
    pub missed: u8,
    /// Whether the dot was inside the window proper from the beginning.
    pub was_inside: bool,
    /// The kind of the dot when it was last seen.
    pub kind: Option<LandmarkKind>,
}

/// All dots that are being followed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Tracks(pub ArrayVec<Track, MOST_CANDIDATES>);

/// Returns the index of the dot in a view closest to an expected position, within a gate.
pub fn nearest(view: &[Point], expected: Point, gate: f64) -> Option<usize> {
    let distance = |index: &usize| (view[*index] - expected).norm_squared();
    let near = (0..view.len()).filter(|index| distance(index) <= gate * gate);
    near.min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

impl Tracks {
    /// Shifts the dots opposite to a movement of the window by `moved`.
    pub fn shift(&mut self, moved: Point) {
        self.0.iter_mut().for_each(|track| track.place = track.place - moved);
    }

    /// Turns all dots counter-clockwise.
    pub fn turn(&mut self, by_rad: f64) {
        self.0.iter_mut().for_each(|track| track.place = track.place.turned(by_rad));
    }

    /// Averages positions with a view from the same place as the last one.
    pub fn average(&mut self, view: View<'_>, gate: f64) {
        self.follow(view, gate, |track, seen| {
            let weight = 1.0 / f64::from(track.seen);
            track.place = track.place + (seen - track.place) * weight;
        });
    }

    /// Updates positions with a view from a new place. `weight`, from 0 to 1, is that of the new positions.
    pub fn update(&mut self, view: View<'_>, gate: f64, weight: f64) {
        self.follow(view, gate, |track, seen| track.place = track.place + (seen - track.place) * weight);
    }

    fn follow(&mut self, view: View<'_>, gate: f64, mut adopt: impl FnMut(&mut Track, Point)) {
        let mut free = Free::new(view.dots);
        for track in &mut self.0 {
            match free.take_nearest(track.place, gate) {
                Some(dot) => {
                    (track.seen, track.missed) = (track.seen.saturating_add(1), 0);
                    track.kind = view.kind(dot).or(track.kind);
                    adopt(track, view.dots[dot]);
                }
                None => track.missed = track.missed.saturating_add(1),
            }
        }
        for dot in free.rest() {
            let (place, kind) = (view.dots[dot], view.kind(dot));
            // If the dots don't fit, the view is too crowded to be described anyway.
            let _ = self.0.try_push(Track { place, seen: 1, missed: 0, was_inside: false, kind });
        }
    }

    /// Marks, by its position, whether each dot was in view.
    pub fn mark(&mut self, is_inside: impl Fn(Point) -> bool) {
        self.0.iter_mut().for_each(|track| track.was_inside = is_inside(track.place));
    }

    /// Marks the dots that the window proper would show if its centre were at this position.
    pub fn mark_inside(&mut self, window: Window, centre: Point) {
        self.mark(|place| window.shows(place - centre));
    }

    /// Forgets dots that the camera can no longer see, and new dots that it has missed for too long.
    pub fn forget(&mut self, window: Window) {
        self.0.retain(|track| {
            window.camera_sees(track.place) && (track.was_inside || track.missed <= MOST_MISSED)
        });
    }

    /// Iterates over the dots seen in more than half of `views` views.
    pub fn confirmed(&self, views: u8) -> impl Iterator<Item = &Track> {
        self.0.iter().filter(move |track| track.seen > views / 2)
    }
}

/// The positions in a view not yet assigned to any dot.
struct Free<'a> {
    view: &'a [Point],
    taken: u128,
}

impl<'a> Free<'a> {
    fn new(view: &'a [Point]) -> Self {
        Self { view: &view[..view.len().min(128)], taken: 0 }
    }

    fn take_nearest(&mut self, expected: Point, gate: f64) -> Option<usize> {
        let distance = |index: &usize| (self.view[*index] - expected).norm_squared();
        let free = (0..self.view.len()).filter(|index| self.taken >> index & 1 == 0);
        let near = free.filter(|index| distance(index) <= gate * gate);
        let index = near.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        self.taken |= 1 << index;
        Some(index)
    }

    fn rest(&self) -> impl Iterator<Item = usize> {
        (0..self.view.len()).filter(|index| self.taken >> index & 1 == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(tracks: &Tracks) -> Vec<(f64, f64)> {
        tracks.0.iter().map(|track| (track.place.x, track.place.y)).collect()
    }

    #[test]
    fn a_moving_window_keeps_its_dots_apart() {
        let mut tracks = Tracks::default();
        tracks.average(View::of(&[Point::new(0.0, 0.0), Point::new(3.0, 0.0)]), 1.0);
        tracks.shift(Point::new(3.0, 0.0));
        // The second dot is now where the first one was.
        tracks.update(View::of(&[Point::new(0.1, 0.0), Point::new(-3.1, 0.0)]), 1.0, 1.0);
        assert_eq!(places(&tracks), [(-3.1, 0.0), (0.1, 0.0)]);
    }

    #[test]
    fn views_from_one_place_are_averaged_and_a_false_dot_is_not_confirmed() {
        let mut tracks = Tracks::default();
        tracks.average(View::of(&[Point::new(0.0, 1.0)]), 1.0);
        tracks.average(View::of(&[Point::new(0.3, 1.0), Point::new(4.0, 4.0)]), 1.0);
        tracks.average(View::of(&[Point::new(0.3, 1.0)]), 1.0);
        let confirmed: Vec<_> = tracks.confirmed(3).collect();
        assert_eq!(confirmed.len(), 1);
        assert!((confirmed[0].place.x - 0.2).abs() < 1e-9, "{confirmed:?}");
    }

    #[test]
    fn a_kind_is_remembered_from_the_last_view_that_has_shown_it() {
        let door = LandmarkKind::of("door");
        let dots = [Point::new(0.0, 1.0), Point::new(3.0, 0.0)];
        let mut tracks = Tracks::default();
        tracks.average(View::of(&dots), 1.0);
        tracks.average(View { dots: &dots, kinds: &[None, door] }, 1.0);
        tracks.average(View::of(&dots), 1.0);
        let kinds: Vec<_> = tracks.confirmed(3).map(|track| track.kind).collect();
        assert_eq!(kinds, [None, door]);
    }

    #[test]
    fn a_dot_that_was_inside_is_believed_until_it_leaves() {
        let window = Window::new(10.0, 1.0).unwrap();
        let mut tracks = Tracks::default();
        tracks.average(View::of(&[Point::new(0.0, 0.0), Point::new(5.5, 0.0)]), 1.0);
        tracks.mark_inside(window, Point::default());
        for _ in 0..4 {
            tracks.update(View::default(), 1.0, 1.0);
            tracks.forget(window);
        }
        assert_eq!(places(&tracks), [(0.0, 0.0)]);
        tracks.shift(Point::new(7.0, 0.0));
        tracks.forget(window);
        assert_eq!(places(&tracks), []);
    }
}
