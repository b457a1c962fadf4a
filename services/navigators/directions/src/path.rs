//! The best path from landmark to landmark (Park and Kender 1995, 5.1 to 5.4).
//!
//! The costs of a path are its distance D, its unreliability −ln R, its number of entries M, its sensing cost S and its time T. A
//! path minimises a weighted sum of them, or the ratio D/R. The ratio of a whole path is not a sum over its parts, but its minimum
//! lies on the convex hull of all (D, −ln R), since ln D − ln R is concave there, so searches with several weights find it exactly.
//!
//! **Measures.** Between *landmarks*, D is the way from dot to dot. Between *windows* (5.4), D is the way of the window's
//! centre, and each landmark counts four times, once for each corner.
//!
//! Ties go to the path with fewer entries, then to the smaller numbers.

mod search;

pub use crate::atlas::Atlas;
use crate::error::Error;
use crate::geometry::{Corner, Point, Window};
use crate::navigator::Settings;
use crate::plane::{DotId, Plane};
use crate::sight::{Eye, is_seen};
use crate::transitions::{Movement, Transition};
use crate::traversal::STEP_S;

/// What the distance of a path is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// From landmark to landmark.
    Landmarks,
    /// The way of the window's centre: context-based.
    Windows,
}

/// The weights of a sum of costs, each from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the distance, in the plane's unit.
    pub distance: f64,
    /// Of −ln R.
    pub unreliability: f64,
    /// Of the number of entries: the length of the map.
    pub entries: f64,
    /// Weight of the number of trajectories.
    pub slides: f64,
}

impl Weights {
    const NONE: Self = Self { distance: 0.0, unreliability: 0.0, entries: 0.0, slides: 0.0 };
    /// Breaks ties in favour of the shortest path.
    const TIE: Self = Self { distance: 1e-9, ..Self::NONE };
}

/// What a path minimises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Objective {
    /// A weighted sum.
    Sum(Weights),
    /// D/R: the paper's compromise.
    Ratio,
}

impl Objective {
    /// The shortest path, by distance.
    pub const SHORTEST: Self = Self::Sum(Weights { distance: 1.0, ..Weights::NONE });
    /// The most reliable path. Of equals, the shortest.
    pub const MOST_RELIABLE: Self = Self::Sum(Weights { unreliability: 1.0, ..Weights::TIE });
    /// The shortest map. Of equals, the shortest path.
    pub const FEWEST_ENTRIES: Self = Self::Sum(Weights { entries: 1.0, ..Weights::TIE });
    /// The least sensing cost, [`Path::sensing`]. Ties go to the shortest path.
    pub const FEWEST_VIEWS: Self =
        Self::Sum(Weights { entries: VIEWS, slides: VIEWS_OF_A_SLIDE - VIEWS, ..Weights::TIE });

    /// The least time, [`Path::time_s`].
    pub fn quickest(settings: &Settings) -> Self {
        let (stop_s, view_s) = (stop_s(settings), view_s(settings));
        Self::Sum(Weights {
            distance: 1.0 / settings.speed,
            entries: stop_s + VIEWS * view_s,
            slides: stop_s + (VIEWS_OF_A_SLIDE - VIEWS) * view_s,
            ..Weights::NONE
        })
    }
}

/// Number of views by which a seek is decided: the one in which the word means a landmark.
const VIEWS: f64 = 1.0;
/// Number of views by which a trajectory is decided: that of the word, that of the pair's line, and that of the landmark that comes
/// in.
const VIEWS_OF_A_SLIDE: f64 = 3.0;

/// How long a decision by one view takes while the window stands.
fn view_s(settings: &Settings) -> f64 {
    f64::from(settings.looks) * STEP_S
}

/// How much longer the window takes to reach a place where it stops than it would at full speed. Within speed/gain of the place it
/// slows down in proportion to the remaining distance, until that is within the tolerance.
fn stop_s(settings: &Settings) -> f64 {
    let &Settings { speed, gain, tolerance, .. } = settings;
    ((speed / (gain * tolerance)).ln() - 1.0).max(0.0) / gain
}

/// Where a journey begins: a view with at least one dot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// The window's centre.
    pub centre: Point,
    /// The dot nearest to it: the landmark that `*` means.
    pub landmark: DotId,
}

impl Start {
    /// From a centre of the window. Rejects a view without a dot.
    pub fn at(plane: &Plane, window: Window, centre: Point) -> Result<Self, Error> {
        let eye = Eye { at: centre, walls: plane.walls() };
        Self::nearest(plane, window, centre, |dot| match window.land {
            None => true,
            Some(land) => {
                let others = plane.around(centre, land.range).filter(|&(_, other)| other != dot);
                is_seen(land, eye, dot - centre, others.map(|(_, other)| other - centre))
            }
        })
    }

    /// At a place to which somebody wants to go: over the dot nearest to it, without a wall between them.
    pub fn wanted(plane: &Plane, window: Window, place: Point) -> Result<Self, Error> {
        Self::nearest(plane, window, place, |dot| !plane.walls().cross(place, dot))
    }

    fn nearest(
        plane: &Plane,
        window: Window,
        centre: Point,
        counts: impl Fn(Point) -> bool,
    ) -> Result<Self, Error> {
        let distance = |dot: Point| (dot - centre).norm_squared();
        let seen = plane.around(centre, window.side / 2.0).filter(|&(_, dot)| counts(dot));
        let nearest =
            seen.min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)).then(b.1.x.total_cmp(&a.1.x)));
        let (landmark, _) = nearest.ok_or(Error::NothingInView { x: centre.x, y: centre.y })?;
        Ok(Self { centre, landmark })
    }

    /// With the window right over a dot.
    pub fn over(plane: &Plane, dot: DotId) -> Result<Self, Error> {
        let landmark = plane.known(dot)?;
        Ok(Self { centre: plane.dot(dot), landmark })
    }

    /// Where a journey along a path ends: with the window over its last landmark, on land with the robot beside it.
    pub fn behind(atlas: &Atlas, path: &Path) -> Self {
        let (from, landmark) = match path.legs.last() {
            Some(leg) => (atlas.centre(leg.from, leg.transition.corner), leg.transition.to),
            None => (path.start.centre, path.start.landmark),
        };
        Self { centre: atlas.over(from, landmark), landmark }
    }
}

/// One transition of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// The landmark where it begins.
    pub from: DotId,
    /// The number of the transition.
    pub number: u32,
    /// The transition.
    pub transition: Transition,
    /// The corner for the landmark that is attained; none at the end.
    pub place: Option<Corner>,
    /// Its distance, by the measure of the path.
    pub distance: f64,
    /// −ln R.
    pub unreliability: f64,
}

/// A path and its costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Where it begins.
    pub start: Start,
    /// Its transitions; none where the start is the goal.
    pub legs: Vec<Leg>,
    /// D, by the measure of the search.
    pub distance: f64,
    /// −ln R.
    pub unreliability: f64,
}

/// −ln R of legs together.
pub(crate) fn unreliability(legs: &[Leg]) -> f64 {
    // An empty sum of floats is minus zero.
    legs.iter().fold(0.0, |sum, leg| sum + leg.unreliability)
}

impl Path {
    /// R.
    pub fn reliability(&self) -> f64 {
        (-self.unreliability).exp()
    }

    /// D/R.
    pub fn ratio(&self) -> f64 {
        self.distance * self.unreliability.exp()
    }

    /// M: the number of entries of its map (5.3), including the first one, which says over which landmark the window stands.
    pub fn entries(&self) -> usize {
        self.legs.len() + 1
    }

    fn slides(&self) -> usize {
        self.legs.iter().filter(|leg| leg.transition.movement != Movement::Seek).count()
    }

    /// S, the sensing cost (5.3): the number of views by which the navigator decides, one for each entry and two more for each
    /// trajectory. The paper names the cost and refers to an earlier work for it; this definition is ours.
    pub fn sensing(&self) -> f64 {
        VIEWS * self.entries() as f64 + (VIEWS_OF_A_SLIDE - VIEWS) * self.slides() as f64
    }

    /// T, the time of an error-free journey (5.3), in seconds: the time for the distance at full speed, for the stops, and for the
    /// views. The window stops once for each entry but the last, and once more for each trajectory. This definition is ours, too.
    pub fn time_s(&self, settings: &Settings) -> f64 {
        let stops = self.legs.len() + self.slides();
        self.distance / settings.speed + stops as f64 * stop_s(settings) + self.sensing() * view_s(settings)
    }

    /// The landmarks, from the start to the goal.
    pub fn landmarks(&self) -> Vec<DotId> {
        std::iter::once(self.start.landmark).chain(self.legs.iter().map(|leg| leg.transition.to)).collect()
    }

    /// The distance by another measure.
    pub fn distance_by(&self, atlas: &Atlas, measure: Measure) -> f64 {
        let first = match (measure, self.legs.first()) {
            (Measure::Windows, Some(leg)) => {
                (atlas.centre(self.start.landmark, leg.transition.corner) - self.start.centre).norm()
            }
            _ => 0.0,
        };
        let leg_distance = |leg: &Leg| match measure {
            Measure::Landmarks => atlas.landmark_distance(leg.from, &leg.transition),
            Measure::Windows => atlas.window_distance(leg.from, &leg.transition, leg.place),
        };
        self.legs.iter().map(leg_distance).fold(first, |sum, way| sum + way)
    }
}

/// The best path. Where none leads to the goal, the error says what would have to be joined.
pub fn best(
    atlas: &Atlas,
    start: Start,
    goal: DotId,
    measure: Measure,
    objective: Objective,
) -> Result<Path, Error> {
    atlas.plane.known(start.landmark)?;
    atlas.plane.known(goal)?;
    let find = |weights| search::search(atlas, start, goal, measure, weights);
    let path = match objective {
        Objective::Sum(weights) => find(weights),
        Objective::Ratio => least_ratio(find),
    };
    path.ok_or_else(|| search::unreachable(atlas, start.landmark, goal))
}

/// The most searches for one ratio.
const MOST_SEARCHES: usize = 64;

/// The path with the least D/R, among the corners of the convex hull of all (D, −ln R).
fn least_ratio(find: impl Fn(Weights) -> Option<Path>) -> Option<Path> {
    let weights = |distance, unreliability| Weights { distance, unreliability, ..Weights::NONE };
    let ends = [find(weights(1.0, 1e-6))?, find(weights(1e-9, 1.0))?];
    let mut best = if ends[0].ratio() <= ends[1].ratio() { ends[0].clone() } else { ends[1].clone() };
    let mut open = vec![ends];
    for _ in 0..MOST_SEARCHES {
        let Some([short, sure]) = open.pop() else { break };
        let (slope, run) = (short.unreliability - sure.unreliability, sure.distance - short.distance);
        if slope <= 1e-9 || run <= 1e-9 {
            continue;
        }
        let path = find(weights(slope, run))?;
        let value = |path: &Path| slope * path.distance + run * path.unreliability;
        // On the edge from one end to the other, there is no corner between them.
        if value(&path) >= value(&short) * (1.0 - 1e-9) {
            continue;
        }
        if path.ratio() < best.ratio() {
            best = path.clone();
        }
        open.push([short, path.clone()]);
        open.push([path, sure]);
    }
    Some(best)
}

#[cfg(test)]
mod tests;
