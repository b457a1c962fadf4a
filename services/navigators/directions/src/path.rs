//! Finds the best path from landmark to landmark (Park and Kender 1995, 5.1 to 5.4).
//!
//! The costs of a path are its distance D, its unreliability −ln R, its number of entries M, its sensing cost S and its time T. A
//! path minimises either a weighted sum of these costs or the ratio D/R. Although the ratio of a whole path is not a sum over its
//! parts, ln D − ln R is concave, so its minimum lies on the convex hull of all points (D, −ln R), and searches with several
//! weights find it exactly.
//!
//! **Measures.** Between *landmarks*, D is the distance from dot to dot. Between *windows* (5.4), D is the distance that the
//! window's centre travels, and each landmark is represented by four nodes, one for each corner.
//!
//! Ties go to the path with fewer entries, then to the one with smaller node numbers.

mod search;

pub use crate::atlas::Atlas;
use crate::error::Error;
use crate::geometry::{Corner, Point, Window};
use crate::navigator::Settings;
use crate::plane::{DotId, Plane};
use crate::sight::{Eye, is_seen};
use crate::transitions::{Movement, Transition};
use crate::traversal::STEP_S;

/// The measure of a path's distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// From landmark to landmark.
    Landmarks,
    /// Along the path of the window's centre, which the paper calls context-based.
    Windows,
}

/// The weights of a sum of costs, none of which is negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Weight of the distance, per unit of length.
    pub distance: f64,
    /// Weight of −ln R.
    pub unreliability: f64,
    /// Weight of the number of entries, which is the length of the map.
    pub entries: f64,
    /// Weight of the number of trajectories.
    pub slides: f64,
}

impl Weights {
    const NONE: Self = Self { distance: 0.0, unreliability: 0.0, entries: 0.0, slides: 0.0 };
    /// Breaks ties in favour of the shortest path.
    const TIE: Self = Self { distance: 1e-9, ..Self::NONE };
}

/// The objective that a path minimises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Objective {
    /// A weighted sum of costs.
    Sum(Weights),
    /// The ratio D/R, which is the paper's compromise.
    Ratio,
}

impl Objective {
    /// The shortest path.
    pub const SHORTEST: Self = Self::Sum(Weights { distance: 1.0, ..Weights::NONE });
    /// The most reliable path. Ties go to the shortest path.
    pub const MOST_RELIABLE: Self = Self::Sum(Weights { unreliability: 1.0, ..Weights::TIE });
    /// The path with the shortest map. Ties go to the shortest path.
    pub const FEWEST_ENTRIES: Self = Self::Sum(Weights { entries: 1.0, ..Weights::TIE });
    /// The path with the least sensing cost, [`Path::sensing`]. Ties go to the shortest path.
    pub const FEWEST_VIEWS: Self =
        Self::Sum(Weights { entries: VIEWS, slides: VIEWS_OF_A_SLIDE - VIEWS, ..Weights::TIE });

    /// Returns the objective that minimises the time, [`Path::time_s`].
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

/// Number of views needed for a seek, in which the word refers to a landmark.
const VIEWS: f64 = 1.0;
/// Number of views needed for a trajectory: one for the word, one for the line through the pair, and one for the landmark that
/// comes into view.
const VIEWS_OF_A_SLIDE: f64 = 3.0;

/// Returns the time for a decision from one view, while the window stands still, in seconds.
fn view_s(settings: &Settings) -> f64 {
    f64::from(settings.looks) * STEP_S
}

/// Returns the additional time for reaching a position and stopping there, compared with full speed, in seconds. Within speed/gain
/// of the position, the window slows down in proportion to the remaining distance until that is within the tolerance.
fn stop_s(settings: &Settings) -> f64 {
    let &Settings { speed, gain, tolerance, .. } = settings;
    ((speed / (gain * tolerance)).ln() - 1.0).max(0.0) / gain
}

/// The start of a journey, at which at least one dot is in view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// Position of the window's centre.
    pub centre: Point,
    /// The dot closest to the centre, which is the landmark that `*` refers to.
    pub landmark: DotId,
}

impl Start {
    /// Creates a start with the window's centre at the given position. Rejects a view without a dot.
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

    /// Creates a start over the dot closest to a requested position, with no wall between the dot and that position.
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

    /// Creates a start with the window directly over a dot.
    pub fn over(plane: &Plane, dot: DotId) -> Result<Self, Error> {
        let landmark = plane.known(dot)?;
        Ok(Self { centre: plane.dot(dot), landmark })
    }

    /// Returns the end of a path as the start of the next one, with the window over the last landmark or, on land, the robot beside
    /// it.
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
    /// The landmark at which the transition begins.
    pub from: DotId,
    /// Number of the transition.
    pub number: u32,
    /// The transition.
    pub transition: Transition,
    /// The corner to move the attained landmark to, or `None` at the end of the path.
    pub place: Option<Corner>,
    /// Distance of this leg, by the measure of the path.
    pub distance: f64,
    /// −ln R of the transition.
    pub unreliability: f64,
}

/// A path and its costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// The start of the path.
    pub start: Start,
    /// The transitions of the path. Empty if the start is the goal.
    pub legs: Vec<Leg>,
    /// The distance D, by the measure of the search.
    pub distance: f64,
    /// The unreliability −ln R.
    pub unreliability: f64,
}

/// Returns the total −ln R of several legs.
pub(crate) fn unreliability(legs: &[Leg]) -> f64 {
    // An empty sum of floats would be minus zero.
    legs.iter().fold(0.0, |sum, leg| sum + leg.unreliability)
}

impl Path {
    /// Returns the reliability R.
    pub fn reliability(&self) -> f64 {
        (-self.unreliability).exp()
    }

    /// Returns the ratio D/R.
    pub fn ratio(&self) -> f64 {
        self.distance * self.unreliability.exp()
    }

    /// Returns the number of map entries M (5.3), including the first entry, which names the landmark under the window.
    pub fn entries(&self) -> usize {
        self.legs.len() + 1
    }

    fn slides(&self) -> usize {
        self.legs.iter().filter(|leg| leg.transition.movement != Movement::Seek).count()
    }

    /// Returns the sensing cost S (5.3), which is the number of views that the navigator needs for its decisions: one for each
    /// entry and two more for each trajectory. For this cost, the paper only refers to earlier work, so the definition is ours.
    pub fn sensing(&self) -> f64 {
        VIEWS * self.entries() as f64 + (VIEWS_OF_A_SLIDE - VIEWS) * self.slides() as f64
    }

    /// Returns the time T of an error-free journey (5.3), in seconds. It is the sum of the time for the
    /// distance at full speed, for the stops, and for the views. The window stops once for each entry except
    /// the last, and once more for each trajectory. This definition, too, is ours.
    pub fn time_s(&self, settings: &Settings) -> f64 {
        let stops = self.legs.len() + self.slides();
        self.distance / settings.speed + stops as f64 * stop_s(settings) + self.sensing() * view_s(settings)
    }

    /// Returns the landmarks, from the start to the goal.
    pub fn landmarks(&self) -> Vec<DotId> {
        std::iter::once(self.start.landmark).chain(self.legs.iter().map(|leg| leg.transition.to)).collect()
    }

    /// Returns the distance by another measure.
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

/// Returns the best path. If no path leads to the goal, the error says which dots would have to be joined.
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

/// Maximum number of searches for the smallest ratio.
const MOST_SEARCHES: usize = 64;

/// Returns the path with the smallest D/R among the corners of the convex hull of all points (D, −ln R).
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
        // If the path lies on the edge between the two ends, there is no corner between them.
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
