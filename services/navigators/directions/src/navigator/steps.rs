//! The steps of the navigator, phase by phase.

use arrayvec::ArrayVec;

use super::guide::{Decision, Guide, Next, Order};
use super::heading::Heading;
use super::tracks::{Track, Tracks, nearest};
use super::view::View;
use super::{Mark, Navigator, Outcome, Phase, Settings, State, detour};
use crate::custom_map::Direction;
use crate::description::{Descriptor, MOST_CANDIDATES};
use crate::geometry::{Corner, Point};
use crate::markers::LandmarkKind;
use crate::sides::Course;
use crate::sight::bearing_rad;
use crate::trajectory::Slide;

/// Displacements to the places from which a robot on land looks again, along the diagonal of the quadrant, as multiples of its
/// distance from the reference. The first place is on the other side of the reference.
const ELSEWHERE: [f64; 2] = [-2.0, 1.0];
/// Time to reach such a place, in seconds.
const ELSEWHERE_S: f64 = 10.0;
/// Directions in which a robot on land makes way, one after the other, if something hides the reference. They are angles to the
/// left of the direction away from the reference, in radians, and are followed by the time for each, in seconds.
const RETREATS_RAD: [f64; 3] = [1.0, -1.0, 0.0];
const RETREAT_S: f64 = 3.0;
/// Number of views in which a new dot must appear during a slide.
const CONFIRMED: u8 = 2;

pub(super) fn step<G: Guide>(
    navigator: &Navigator<G>,
    state: &mut State<G::Memory>,
    view: View<'_>,
    elapsed_s: f64,
) {
    if state.outcome().is_some() {
        return;
    }
    let settings = &navigator.settings;
    state.spent_s += elapsed_s;
    let moved = state.moves(settings, elapsed_s);
    state.before.shift(moved);
    state.tracks.shift(moved);
    state.began = state.began.map(|place| place - moved);
    let is_lost = state.reference.as_mut().is_some_and(|mark| {
        let expected = mark.place - moved;
        let is_seen = mark.follow(settings, view, moved);
        // Dots seen earlier keep their positions relative to the reference, however the window has moved.
        state.before.shift(expected - mark.place);
        state.began = state.began.map(|place| place - (expected - mark.place));
        !is_seen
    });
    // During a slide, the reference is expected to leave the view.
    let is_lost = is_lost && !matches!(state.phase, Phase::Slide { .. });
    if state.spent_s <= settings.longest_entry_s && state.retreats(settings, is_lost, elapsed_s) {
        return;
    }
    if is_lost || state.spent_s > settings.longest_entry_s {
        return state.finish(Outcome::CannotLocate);
    }
    match state.phase {
        Phase::Orient => orient(navigator, state, view),
        Phase::Describe { word, corner, is_recovery } => {
            describe(navigator, state, view, word, corner, is_recovery);
        }
        Phase::Elsewhere { word, corner, is_recovery, until_s } => {
            let displacement = to_corner(state, settings, corner) + aside(settings, corner, state.elsewhere);
            if state.approaches(settings, displacement, view) || state.spent_s > until_s {
                state.velocity = Point::default();
                state.phase = Phase::Describe { word, corner: Some(corner), is_recovery };
            }
        }
        Phase::Centre { second } => centre(navigator, state, view, second, moved),
        Phase::Slide { along, aside, slid } => {
            let (aside, slid) = (aside - moved.dot(left_of(along)), slid + moved.dot(along));
            state.phase = Phase::Slide { along, aside, slid };
            slide(navigator, state, view, along, aside, slid);
        }
        Phase::Around { corner } => around(navigator, state, view, corner),
        Phase::Adjust { corner, next } => adjust(navigator, state, view, corner, next),
        Phase::Finished { .. } => {}
    }
}

/// Brings the reference under the middle of the window. Returns true, with the window at rest, once it is there or out of sight. A
/// robot on land has to see the reference at the end.
pub(super) fn hover<M>(settings: &Settings, state: &mut State<M>, view: View<'_>, elapsed_s: f64) -> bool {
    let moved = state.moves(settings, elapsed_s);
    let Some(mark) = &mut state.reference else { return true };
    let is_followed = mark.follow(settings, view, moved);
    let (place, is_seen) = (mark.place, mark.missed == 0 || settings.window.land.is_none());
    if state.retreats(settings, !is_followed, elapsed_s) {
        return false;
    }
    if !is_followed {
        state.velocity = Point::default();
        if !is_seen {
            state.finish(Outcome::CannotLocate);
        }
        return true;
    }
    state.approaches(settings, settings.window.over(place), view) && is_seen
}

impl Mark {
    fn new(place: Point) -> Self {
        Self { place, missed: 0 }
    }

    /// Updates the landmark's position with a new view. Returns false if it has been out of sight for too long.
    fn follow(&mut self, settings: &Settings, view: View<'_>, moved: Point) -> bool {
        self.place = self.place - moved;
        match nearest(view.dots, self.place, settings.gate) {
            Some(index) => {
                self.missed = 0;
                self.place = self.place + (view.dots[index] - self.place) * settings.weight;
            }
            None => self.missed = self.missed.saturating_add(1),
        }
        self.missed <= settings.patience
    }
}

impl<M> State<M> {
    fn finish(&mut self, outcome: Outcome) {
        self.velocity = Point::default();
        self.phase = Phase::Finished { outcome };
    }

    /// Returns the movement since the last step, and adds the uncertainty of the heading after it.
    fn moves(&mut self, settings: &Settings, elapsed_s: f64) -> Point {
        let moved = self.velocity * elapsed_s;
        self.heading.drift(settings.heading_drift_rad, moved.norm());
        if let (Some(turning), Some(way)) = (settings.turning, moved.direction()) {
            let faces = way.turned(-self.heading.turned_rad);
            self.heading.drift(turning.drift_rad, bearing_rad(self.faces, faces).abs());
            self.faces = faces;
        }
        moved
    }

    /// On land, makes way for a while if the reference is out of sight, because a person in the line of sight may be waiting for
    /// the robot to move. Returns false if this is not necessary, or was done too often.
    fn retreats(&mut self, settings: &Settings, is_lost: bool, elapsed_s: f64) -> bool {
        let Some(mark) = self.reference.as_mut().filter(|_| settings.window.land.is_some()) else {
            return false;
        };
        self.retreat_s = (self.retreat_s - elapsed_s).max(0.0);
        if is_lost && usize::from(self.retreats) < RETREATS_RAD.len() {
            (self.retreats, self.retreat_s, mark.missed) = (self.retreats + 1, RETREAT_S, 0);
        }
        if self.retreat_s == 0.0 {
            return false;
        }
        let aside_rad = RETREATS_RAD[usize::from(self.retreats.saturating_sub(1)) % RETREATS_RAD.len()];
        let away = -mark.place.direction().unwrap_or_default();
        self.velocity = away.turned(aside_rad) * settings.speed;
        // Views from different places are not averaged.
        self.looks = 0;
        true
    }

    /// Updates the direction of travel at the end of an entry, unless the entry ends at the landmark at which it began.
    fn turns_course(&mut self, gate: f64) {
        let Some(Mark { place, .. }) = self.reference else { return };
        let way = self.began.map(|began| place - began).filter(|way| way.norm() > gate);
        self.course = way.map_or(self.course, Course::of);
        self.began = Some(place);
    }

    /// Adds a view taken at rest. Returns true once there are enough of them.
    fn has_looked(&mut self, settings: &Settings, view: View<'_>) -> bool {
        self.velocity = Point::default();
        if self.looks == 0 {
            self.tracks = Tracks::default();
        }
        self.tracks.average(view, settings.gate);
        self.looks += 1;
        self.looks >= settings.looks
    }

    /// Moves the window by a displacement and, on land, around obstacles. Returns true, with the window at rest, on arrival.
    fn approaches(&mut self, settings: &Settings, displacement: Point, view: View<'_>) -> bool {
        let distance = displacement.norm();
        let is_there = distance <= settings.tolerance;
        let speed = (distance * settings.gain).min(settings.speed);
        self.velocity = match (is_there, settings.window.land) {
            (true, _) => Point::default(),
            (false, None) => displacement * (speed / distance),
            (false, Some(land)) => detour::direction(displacement, view.dots, land.clearance)
                .map_or(Point::default(), |way| way * speed),
        };
        is_there
    }

    /// Returns the position of a landmark, averaged over the views taken at rest, and the positions of the other dots in these
    /// views. If a kind is given, only dots known to be of that kind are included.
    fn others(
        &self,
        settings: &Settings,
        landmark: Option<Mark>,
        kind: Option<LandmarkKind>,
    ) -> (Point, ArrayVec<Point, MOST_CANDIDATES>) {
        let confirmed = || self.tracks.confirmed(settings.looks);
        let all: ArrayVec<Point, MOST_CANDIDATES> = confirmed().map(|track| track.place).collect();
        let own = landmark.and_then(|mark| nearest(&all, mark.place, settings.gate));
        let at = landmark.map_or(Point::default(), |mark| mark.place);
        let is_meant = |(index, track): &(usize, &Track)| {
            Some(*index) != own && kind.is_none_or(|kind| track.kind == Some(kind))
        };
        let others = confirmed().enumerate().filter(is_meant).map(|(_, track)| track.place);
        (own.map_or(at, |own| all[own]), others.collect())
    }
}

/// Returns the displacement that brings the reference to a corner.
fn to_corner<M>(state: &State<M>, settings: &Settings, corner: Corner) -> Point {
    state.reference.map_or(Point::default(), |mark| mark.place) + settings.window.centre_from(corner)
}

/// Finds the heading by the landmarks around the start.
fn orient<G: Guide>(navigator: &Navigator<G>, state: &mut State<G::Memory>, view: View<'_>) {
    let settings = &navigator.settings;
    if !state.has_looked(settings, view) {
        return;
    }
    state.looks = 0;
    let (_, seen) = state.others(settings, None, None);
    match navigator.guide.around().and_then(|around| around.turned_rad(&seen)) {
        Some(turned_rad) => {
            (state.heading, state.waited) = (Heading::found(turned_rad), 0);
            state.phase = navigator.begins(&state.memory, state.heading);
        }
        None if state.waited < settings.patience => state.waited += 1,
        None => state.finish(Outcome::CannotLocate),
    }
}

fn describe<G: Guide>(
    navigator: &Navigator<G>,
    state: &mut State<G::Memory>,
    view: View<'_>,
    word: Descriptor,
    corner: Option<Corner>,
    is_recovery: bool,
) {
    let settings = &navigator.settings;
    if !state.has_looked(settings, view) {
        return;
    }
    state.looks = 0;
    let order = navigator.guide.order(&state.memory);
    let bearing_deg = order.bearing_deg.filter(|_| !is_recovery);
    let sought = Order { word, bearing_deg, kind: order.kind.filter(|_| !is_recovery), ..order };
    let found = picked(state, settings, view.dots.len(), &sought, corner);
    let Some(place) = found else {
        match state.waited < patience(settings, corner) {
            true => state.waited += 1,
            false => go_without(navigator, state),
        }
        return;
    };
    state.waited = 0;
    remember(state, settings, corner);
    let turn_rad = correct_heading(state, settings, bearing_deg, place);
    let place = place.turned(turn_rad);
    let is_trajectory = order.trajectory.is_some() && !is_recovery;
    if is_trajectory && state.reference.is_some() {
        state.phase = Phase::Centre { second: Mark::new(place) };
    } else if is_trajectory {
        // Without a reference, there is no line to slide along.
        state.finish(Outcome::CannotLocate);
    } else {
        attain(navigator, state, place);
    }
}

/// Returns the number of times that the navigator looks again from one place. On land, it divides its patience among several
/// places.
fn patience(settings: &Settings, corner: Option<Corner>) -> u8 {
    let has_places = settings.window.land.is_some() && corner.is_some();
    settings.patience / if has_places { 1 + ELSEWHERE.len() as u8 } else { 1 }
}

/// Follows the guide's decision if no landmark fits the word. A robot on land first looks again from other places.
fn go_without<G: Guide>(navigator: &Navigator<G>, state: &mut State<G::Memory>) {
    if state.reference.is_none() {
        return state.finish(Outcome::CannotLocate);
    }
    state.waited = 0;
    let decision = navigator.guide.nothing(&mut state.memory, &navigator.settings);
    let gives_up = matches!(decision, Decision::Finish(_)) && navigator.settings.window.land.is_some();
    match state.phase {
        Phase::Describe { word, corner: Some(corner), is_recovery }
            if gives_up && usize::from(state.elsewhere) < ELSEWHERE.len() =>
        {
            state.elsewhere += 1;
            let until_s = state.spent_s + ELSEWHERE_S;
            state.phase = Phase::Elsewhere { word, corner, is_recovery, until_s };
        }
        _ => follow(state, decision),
    }
}

/// Returns the displacement from the corner to another place, given by its number from 1.
fn aside(settings: &Settings, corner: Corner, elsewhere: u8) -> Point {
    let along = usize::from(elsewhere).checked_sub(1).and_then(|place| ELSEWHERE.get(place));
    settings.window.centre_from(corner) * along.copied().unwrap_or_default()
}

/// Corrects the heading by the bearing of a landmark at this position. Returns the angle by which the map's axes have turned.
fn correct_heading<M>(
    state: &mut State<M>,
    settings: &Settings,
    bearing_deg: Option<u16>,
    place: Point,
) -> f64 {
    let (Some(bearing_deg), Some(mark)) = (bearing_deg, state.reference) else { return 0.0 };
    let turn_rad = state.heading.correct(bearing_deg, place - mark.place, settings.tolerance);
    state.reference = Some(Mark { place: mark.place.turned(turn_rad), ..mark });
    state.before.turn(turn_rad);
    state.began = state.began.map(|place| place.turned(turn_rad));
    turn_rad
}

/// Remembers the dots that will not count as new in the next view, namely the reference and the dots in the window proper around
/// it.
fn remember<M>(state: &mut State<M>, settings: &Settings, corner: Option<Corner>) {
    let (origin, _) = state.others(settings, state.reference, None);
    let window = settings.window;
    state.tracks.mark(|place| match corner {
        Some(corner) => place == origin || corner.covers(place - origin, window.side),
        None => window.shows(place),
    });
    std::mem::swap(&mut state.before, &mut state.tracks);
}

/// Returns the position of the landmark that a word refers to, relative to the window's centre. With a bearing, `*` refers to the
/// landmark at that bearing, which a robot on land also finds outside the quadrant.
fn picked<M>(
    state: &State<M>,
    settings: &Settings,
    dots: usize,
    &Order { kind, word, bearing_deg, .. }: &Order,
    corner: Option<Corner>,
) -> Option<Point> {
    if dots > MOST_CANDIDATES {
        return None;
    }
    let (origin, others) = state.others(settings, state.reference, kind);
    if word == Descriptor::Same {
        return state.reference.map(|_| origin);
    }
    if let Descriptor::Counted(side, ordinal) = word {
        let is_counted = |dot: &Point| settings.window.land.is_some() || settings.window.shows(*dot);
        let counted: ArrayVec<Point, MOST_CANDIDATES> = others.into_iter().filter(is_counted).collect();
        return state.course.pick(side, ordinal, &counted).map(|index| counted[index]);
    }
    let shown = |slack: f64| -> ArrayVec<Point, MOST_CANDIDATES> {
        let is_shown = |dot: &Point| match corner {
            Some(corner) => corner.nearly_covers(*dot, settings.window.side, slack),
            None => settings.window.shows(*dot + origin),
        };
        others.iter().map(|&dot| dot - origin).filter(is_shown).collect()
    };
    if let (Descriptor::Any, Some(bearing_deg)) = (word, bearing_deg) {
        let candidates = match settings.window.land {
            Some(_) => others.iter().map(|&dot| dot - origin).collect(),
            None => shown(settings.slack()),
        };
        let picked = state.heading.pick(bearing_deg, &candidates, settings.tolerance);
        return picked.map(|index| candidates[index] + origin);
    }
    let mut candidates = shown(0.0);
    if candidates.is_empty() {
        // A position error may have put the only candidate outside the quadrant.
        candidates = shown(settings.slack());
    }
    if word == Descriptor::New {
        let known = || state.before.0.iter().filter(|old| old.was_inside);
        let is_old = |dot: Point| known().any(|old| (old.place - dot).norm() <= settings.gate);
        candidates.retain(|dot| !is_old(*dot + origin));
    }
    word.pick(&candidates).map(|index| candidates[index] + origin)
}

/// Makes the landmark at a position the reference, then looks around it or continues.
fn attain<G: Guide>(navigator: &Navigator<G>, state: &mut State<G::Memory>, place: Point) {
    state.reference = Some(Mark::new(place));
    (state.elsewhere, state.retreats) = (0, 0);
    state.signature = Default::default();
    state.looks = 0;
    match navigator.guide.order(&state.memory).looks_around {
        true => state.phase = Phase::Around { corner: 0 },
        false => respond(navigator, state),
    }
}

fn centre<G: Guide>(
    navigator: &Navigator<G>,
    state: &mut State<G::Memory>,
    view: View<'_>,
    mut second: Mark,
    moved: Point,
) {
    let settings = &navigator.settings;
    if !second.follow(settings, view, moved) {
        return state.finish(Outcome::CannotLocate);
    }
    state.phase = Phase::Centre { second };
    let Some(first) = state.reference else { return state.finish(Outcome::CannotLocate) };
    // Once the navigator has begun to look, it stands still.
    if state.looks == 0 && !state.approaches(settings, (first.place + second.place) * 0.5, view) {
        return;
    }
    if !state.has_looked(settings, view) {
        return;
    }
    state.looks = 0;
    let (from, _) = state.others(settings, Some(first), None);
    let (to, _) = state.others(settings, Some(second), None);
    let is_backward = navigator.guide.order(&state.memory).trajectory == Some(Direction::Backward);
    let Some(along) = (to - from).direction() else { return state.finish(Outcome::CannotLocate) };
    let along = if is_backward { -along } else { along };
    let middle = (from + to) * 0.5;
    state.tracks.mark_inside(settings.window, middle);
    state.phase = Phase::Slide { along, aside: middle.dot(left_of(along)), slid: -middle.dot(along) };
}

/// Returns the direction to the left of a direction.
fn left_of(along: Point) -> Point {
    Point::new(-along.y, along.x)
}

fn slide<G: Guide>(
    navigator: &Navigator<G>,
    state: &mut State<G::Memory>,
    view: View<'_>,
    along: Point,
    aside: f64,
    slid: f64,
) {
    let settings = &navigator.settings;
    let velocity = along * settings.speed + left_of(along) * (aside * settings.gain);
    state.velocity = velocity * (settings.speed / velocity.norm());
    state.tracks.update(view, settings.gate, settings.weight);
    state.tracks.forget(settings.window);
    // The window should be exactly over the line. A dot near a corner may enter and leave the window between two views.
    let line = Slide { from: left_of(along) * aside, along };
    let entered =
        state.tracks.0.iter().filter(|track| !track.was_inside && track.seen >= CONFIRMED).filter_map(
            |track| {
                let (enters, _) = line.span(settings.window, track.place)?;
                (-slid < enters && enters <= 0.0).then_some((enters, track.place))
            },
        );
    if let Some((enters, place)) = entered.min_by(|a, b| a.0.total_cmp(&b.0)) {
        state.velocity = Point::default();
        // The window has slid further since the landmark entered.
        state.tracks.mark_inside(settings.window, left_of(along) * aside + along * enters);
        std::mem::swap(&mut state.before, &mut state.tracks);
        attain(navigator, state, place);
    }
}

fn around<G: Guide>(navigator: &Navigator<G>, state: &mut State<G::Memory>, view: View<'_>, corner: u8) {
    let settings = &navigator.settings;
    let quadrant = Corner::ROUND[usize::from(corner)];
    if state.looks == 0 && !state.approaches(settings, to_corner(state, settings, quadrant), view) {
        return;
    }
    if !state.has_looked(settings, view) {
        return;
    }
    state.looks = 0;
    let (origin, others) = state.others(settings, state.reference, None);
    let held = others.iter().filter(|dot| quadrant.covers(**dot - origin, settings.window.side));
    held.for_each(|_| state.signature.occupy(quadrant));
    if usize::from(corner) + 1 < Corner::ROUND.len() {
        state.phase = Phase::Around { corner: corner + 1 };
    } else {
        respond(navigator, state);
    }
}

fn respond<G: Guide>(navigator: &Navigator<G>, state: &mut State<G::Memory>) {
    let decision = navigator.guide.attained(&mut state.memory, state.signature, &navigator.settings);
    follow(state, decision);
}

fn follow<M>(state: &mut State<M>, decision: Decision) {
    match decision {
        Decision::Adjust { corner, next } => state.phase = Phase::Adjust { corner, next },
        Decision::Finish(outcome) => state.finish(outcome),
    }
}

fn adjust<G: Guide>(
    navigator: &Navigator<G>,
    state: &mut State<G::Memory>,
    view: View<'_>,
    corner: Corner,
    next: Next,
) {
    if !state.approaches(&navigator.settings, to_corner(state, &navigator.settings, corner), view) {
        return;
    }
    let to = match next {
        Next::Seek(word) => {
            state.phase = Phase::Describe { word, corner: Some(corner), is_recovery: true };
            return;
        }
        Next::Entry(to) => to,
    };
    state.spent_s = 0.0;
    state.turns_course(navigator.settings.gate);
    match navigator.guide.enter(&mut state.memory, to) {
        true => {
            let word = navigator.guide.order(&state.memory).word;
            state.phase = Phase::Describe { word, corner: Some(corner), is_recovery: false };
        }
        false => state.finish(Outcome::Arrived),
    }
}
