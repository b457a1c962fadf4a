//! The transition matrix, which lists the landmarks that are attained directly from each landmark, and how (Park and Kender 1995,
//! 5.1).
//!
//! The matrix is sparse and stored as a list of transitions for each landmark. For each of the four corners, a word has at most one
//! target, and each pair of reference and target has up to two trajectories.

use std::ops::Range;

use petgraph::algo::kosaraju_scc;
use petgraph::graph::DiGraph;

use crate::description::{Descriptor, MOST_CANDIDATES};
use crate::geometry::{Corner, Point, Window};
use crate::markers::LandmarkKind;
use crate::plane::{DotId, Plane};
use crate::sight::{Eye, is_seen};
use crate::trajectory::Slide;

/// How the navigator moves to the target of a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Movement {
    /// The navigator seeks a landmark that it sees, so the transition lies within a parkway.
    Seek,
    /// The navigator slides from the reference towards the landmark that it sees: `Trajp`.
    Forward,
    /// The navigator slides in the opposite direction, away from the landmark that it sees: `Trajn`.
    Backward,
}

/// A transition from one landmark to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// The landmark attained.
    pub to: DotId,
    /// The landmark that the word refers to: the target itself, or the second of a trajectory's pair.
    pub seen: DotId,
    /// Distance that the window slides, in the plane's unit, or 0 for a transition within a parkway.
    pub slide: f32,
    /// Number of candidates that the word chooses from, or 1 if the landmark is known by its bearing.
    pub candidates: u16,
    /// The corner of the window where the reference lies.
    pub corner: Corner,
    /// The word that refers to `seen`.
    pub word: Descriptor,
    /// Whether the word only chooses from landmarks of the same kind as `seen`.
    pub by_kind: bool,
    /// The movement to the target.
    pub movement: Movement,
}

/// All transitions of a plane, indexed by the landmark at which they begin.
#[derive(Debug, Clone, PartialEq)]
pub struct Transitions {
    begins: Vec<u32>,
    entries: Vec<Transition>,
}

/// The kinds of transitions that a map-maker looks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kinds<'a> {
    /// The words to use. [`Descriptor::Any`] refers to any landmark by its bearing, for which the robot has to know its heading. On
    /// land, this includes landmarks outside the quadrant. Among walls, [`Descriptor::Same`] leads from one side of a landmark to
    /// another. Apart from these two, only words in [`Descriptor::DEFINITE`] yield transitions.
    pub words: &'a [Descriptor],
    /// Whether to look for trajectories as well.
    pub trajectories: bool,
}

impl Kinds<'_> {
    /// The kinds used by the paper's system: the isolated landmark, in parkways and trajectories.
    pub const PAPER: Self = Self { words: &[Descriptor::Isolated], trajectories: true };
    /// Isolated parkways, without trajectories.
    pub const ISOLATED: Self = Self { words: &[Descriptor::Isolated], trajectories: false };
    /// Obvious parkways, without trajectories.
    pub const OBVIOUS: Self = Self { words: &[Descriptor::Obvious], trajectories: false };
}

/// The candidates of a landmark: the dots in one of its quadrants, with positions relative to the landmark.
#[derive(Debug, Default)]
pub struct Candidates {
    /// Numbers of the dots.
    pub dots: Vec<DotId>,
    /// Positions of the dots, relative to the landmark.
    pub places: Vec<Point>,
    /// On land, the dots in sight outside the quadrant. Only a bearing can refer to one of them.
    pub beside: Vec<DotId>,
    /// The dots, in the quadrant or outside, whose kind the robot may see.
    pub marked: Vec<(DotId, LandmarkKind)>,
}

impl Candidates {
    /// Finds the candidates of a landmark that lies in a corner. On land, only dots that are seen from beside the landmark
    /// count.
    pub fn find(&mut self, plane: &Plane, window: Window, landmark: DotId, corner: Corner) {
        self.dots.clear();
        self.places.clear();
        self.beside.clear();
        self.marked.clear();
        let place = plane.dot(landmark);
        let Some(land) = window.land else {
            let far = place + corner.inward() * window.side;
            let low = Point::new(place.x.min(far.x), place.y.min(far.y));
            let high = Point::new(place.x.max(far.x), place.y.max(far.y));
            for (dot, at) in plane.within(low, high).filter(|&(dot, _)| dot != landmark) {
                self.dots.push(dot);
                self.places.push(at - place);
            }
            return;
        };
        let eye = Eye { at: place + window.centre_from(corner), walls: plane.walls() };
        for (dot, at) in plane.around(eye.at, land.range).filter(|&(dot, _)| dot != landmark) {
            let others = plane.around(eye.at, land.range).filter(|&(other, _)| other != dot);
            if !is_seen(land, eye, at - eye.at, others.map(|(_, at)| at - eye.at)) {
                continue;
            }
            self.marked.extend(plane.shown(dot, at - eye.at).map(|shown| (dot, shown.kind)));
            if corner.covers(at - place, window.side) {
                self.dots.push(dot);
                self.places.push(at - place);
            } else {
                self.beside.push(dot);
            }
        }
    }

    /// Returns the dot that a word refers to, or `None` for words whose landmark isn't known beforehand.
    pub fn pick(&self, word: Descriptor) -> Option<DotId> {
        Descriptor::DEFINITE
            .contains(&word)
            .then(|| word.pick(&self.places))
            .flatten()
            .map(|index| self.dots[index])
    }

    /// Returns only the candidates that the robot may see to be of this kind.
    fn of_kind(&self, kind: LandmarkKind) -> Self {
        let is_own = |dot: &DotId| self.marked.contains(&(*dot, kind));
        let (dots, places) = self
            .dots
            .iter()
            .zip(&self.places)
            .filter(|(dot, _)| is_own(dot))
            .map(|(dot, at)| (*dot, *at))
            .unzip();
        let beside = self.beside.iter().copied().filter(is_own).collect();
        Self { dots, places, beside, marked: Vec::new() }
    }

    /// Returns the kinds that the robot may see, each once.
    fn kinds(&self) -> Vec<LandmarkKind> {
        let mut kinds: Vec<_> = self.marked.iter().map(|(_, kind)| *kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        kinds
    }
}

impl Transitions {
    /// Finds all transitions of these kinds. For a given density, this takes time proportional to the number of dots.
    pub fn new(plane: &Plane, window: Window, kinds: Kinds<'_>) -> Self {
        let mut begins = Vec::with_capacity(plane.len() + 1);
        let mut entries = Vec::new();
        let mut candidates = Candidates::default();
        // In an open field, a robot can reach every side of a landmark from any direction.
        let turns = kinds.words.contains(&Descriptor::Same) && !plane.walls().is_empty();
        begins.push(0);
        for from in 0..plane.len() as DotId {
            for corner in Corner::ALL {
                candidates.find(plane, window, from, corner);
                let words = kinds.words.iter();
                // A path uses the first of several equally probable transitions, and kinds make a route easier for people to
                // follow.
                for kind in candidates.kinds() {
                    let own = candidates.of_kind(kind);
                    let seeks = words.clone().flat_map(|&word| seeks(&own, corner, word));
                    entries.extend(seeks.map(|seek| Transition { by_kind: true, ..seek }));
                }
                for seek in words.clone().flat_map(|&word| seeks(&candidates, corner, word)) {
                    entries.push(seek);
                    // On land, the robot drives from landmark to landmark and never slides.
                    if kinds.trajectories && window.land.is_none() {
                        entries.extend(trajectories(plane, window, from, seek));
                    }
                }
                entries.extend(turns.then(|| around(from, corner)));
            }
            begins.push(entries.len() as u32);
        }
        Self { begins, entries }
    }

    /// Returns the number of landmarks.
    pub fn landmarks(&self) -> usize {
        self.begins.len() - 1
    }

    /// Returns the number of transitions.
    pub fn count(&self) -> usize {
        self.entries.len()
    }

    /// Returns the transitions that begin at a landmark.
    pub fn from(&self, landmark: DotId) -> &[Transition] {
        let landmark = landmark as usize;
        &self.entries[self.begins[landmark] as usize..self.begins[landmark + 1] as usize]
    }

    /// Returns the numbers of the transitions that begin at a landmark.
    pub fn numbers(&self, landmark: DotId) -> Range<u32> {
        self.begins[landmark as usize]..self.begins[landmark as usize + 1]
    }

    /// Returns a transition by its number, from 0.
    pub fn number(&self, number: u32) -> &Transition {
        &self.entries[number as usize]
    }

    /// Returns the landmark at which a transition begins, by the transition's number.
    pub fn origin(&self, number: u32) -> DotId {
        self.begins.partition_point(|&begin| begin <= number) as DotId - 1
    }

    /// Iterates over all transitions, each with the landmark at which it begins.
    pub fn all(&self) -> impl Iterator<Item = (DotId, &Transition)> {
        (0..self.landmarks() as DotId).flat_map(|from| self.from(from).iter().map(move |entry| (from, entry)))
    }

    /// Returns the transitions that pass a test, such as the reliable, error-detectable or error-recoverable parkways and
    /// trajectories (4.2.3, 4.2.4).
    pub fn filtered(&self, mut keeps: impl FnMut(DotId, &Transition) -> bool) -> Self {
        let mut kept = Self { begins: vec![0], entries: Vec::new() };
        for from in 0..self.landmarks() as DotId {
            kept.entries.extend(self.from(from).iter().filter(|entry| keeps(from, entry)));
            kept.begins.push(kept.entries.len() as u32);
        }
        kept
    }

    /// Returns the number of landmarks from which each landmark is attained directly. A good landmark is attained from many others
    /// (5.1).
    pub fn attained_from(&self) -> Vec<u32> {
        let mut counts = vec![0; self.landmarks()];
        let mut last = vec![DotId::MAX; self.landmarks()];
        for (from, entry) in self.all().filter(|(from, entry)| entry.to != *from) {
            let to = entry.to as usize;
            counts[to] += u32::from(last[to] != from);
            last[to] = from;
        }
        counts
    }

    /// Returns the strongly connected components, which are the parkways that remain separate.
    pub fn components(&self) -> Components {
        let mut graph = DiGraph::<(), (), u32>::with_capacity(self.landmarks(), self.count());
        for _ in 0..self.landmarks() {
            graph.add_node(());
        }
        for (from, entry) in self.all() {
            graph.add_edge(from.into(), entry.to.into(), ());
        }
        let mut components = Components { of: vec![0; self.landmarks()], sizes: Vec::new() };
        for component in kosaraju_scc(&graph) {
            for node in &component {
                components.of[node.index()] = components.sizes.len() as u32;
            }
            components.sizes.push(component.len() as u32);
        }
        components
    }
}

/// Returns the transition to the landmark that a word refers to or, by their bearings, to all of them.
fn seeks(
    candidates: &Candidates,
    corner: Corner,
    word: Descriptor,
) -> impl Iterator<Item = Transition> + use<'_> {
    // The cast can't overflow, since no word refers to any of more than [`MOST_CANDIDATES`] dots.
    let count = candidates.dots.len() as u16;
    let by_bearing =
        word == Descriptor::Any && candidates.dots.len() + candidates.beside.len() <= MOST_CANDIDATES;
    let all = || candidates.dots.iter().chain(&candidates.beside).copied();
    let among = if by_bearing { 1 } else { count };
    let known = by_bearing.then(all).into_iter().flatten();
    candidates.pick(word).into_iter().chain(known).map(move |seen| Transition {
        to: seen,
        seen,
        slide: 0.0,
        candidates: among,
        corner,
        word,
        by_kind: false,
        movement: Movement::Seek,
    })
}

/// Returns the transition from one side of a landmark to another.
fn around(landmark: DotId, corner: Corner) -> Transition {
    Transition {
        to: landmark,
        seen: landmark,
        slide: 0.0,
        candidates: 1,
        corner,
        word: Descriptor::Same,
        by_kind: false,
        movement: Movement::Seek,
    }
}

/// Returns the trajectories along the line through the reference and the visible landmark, forwards and backwards.
fn trajectories(
    plane: &Plane,
    window: Window,
    from: DotId,
    seek: Transition,
) -> impl Iterator<Item = Transition> + '_ {
    [Movement::Forward, Movement::Backward].into_iter().filter_map(move |movement| {
        let slide = Slide::of_pair(plane.dot(from), plane.dot(seek.seen), movement == Movement::Backward)?;
        let landing = slide.lands(plane, window)?;
        Some(Transition { to: landing.dot, slide: landing.distance as f32, movement, ..seek })
    })
}

/// A partition of the landmarks into components.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// The component of each landmark.
    pub of: Vec<u32>,
    /// Number of landmarks of each component.
    pub sizes: Vec<u32>,
}

impl Components {
    /// Returns the number of components.
    pub fn count(&self) -> usize {
        self.sizes.len()
    }

    /// Returns true if two landmarks are in the same component.
    pub fn joins(&self, a: DotId, b: DotId) -> bool {
        self.of[a as usize] == self.of[b as usize]
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geometry::Land;
    use crate::testing::{camera, plane, plane_of_kinds};
    use crate::walls::{Body, Walls};

    fn window() -> Window {
        Window::new(10.0, 0.0).unwrap()
    }

    /// Figure 13 in miniature: A, B and C see each other, as do D and E. The only trajectories lead from D and E to C.
    fn figure_13() -> Plane {
        plane(&[(0.0, 0.0), (6.0, 3.0), (8.0, 9.0), (40.0, 9.0), (47.0, 9.5)])
    }

    #[test]
    fn parkways_apart_are_components_and_trajectories_join_them_one_way() {
        let world = figure_13();
        let parkways = Transitions::new(&world, window(), Kinds::ISOLATED).components();
        // B lies between A and C, so it is not the isolated landmark for either of them.
        assert_eq!(parkways.count(), 3);
        assert!(parkways.joins(0, 2) && parkways.joins(3, 4) && !parkways.joins(2, 3));
        let all = Transitions::new(&world, window(), Kinds::PAPER);
        let crossing: Vec<_> = all.all().filter(|(from, e)| (*from >= 3) != (e.to >= 3)).collect();
        assert!(!crossing.is_empty());
        assert!(crossing.iter().all(|(from, e)| *from >= 3 && e.movement != Movement::Seek));
    }

    #[test]
    fn a_transition_tells_where_it_leads_and_by_what() {
        let all = Transitions::new(&figure_13(), window(), Kinds::PAPER);
        // With D in the south-west corner, only E is in view. The line from E to D leads west to C.
        let of_d: Vec<_> = all.from(3).iter().filter(|e| e.corner == Corner::Sw).collect();
        assert_eq!(of_d.len(), 2, "{of_d:?}");
        assert_eq!((of_d[0].to, of_d[0].movement, of_d[0].candidates), (4, Movement::Seek, 1));
        assert_eq!((of_d[1].to, of_d[1].seen, of_d[1].movement), (2, 4, Movement::Backward));
        assert!((of_d[1].slide - 30.5).abs() < 0.2, "{}", of_d[1].slide);
    }

    /// Of the two doors, the camera cannot see the farther one. There is only one flight of stairs, and the machine is behind the
    /// robot.
    #[test]
    fn by_its_kind_a_word_chooses_from_fewer_landmarks() {
        let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
        let dots = [
            (0.0, 0.0, "door"),
            (3.0, 1.0, "door"),
            (1.5, 7.2, "door"),
            (2.0, 3.5, "stairs"),
            (5.5, 5.5, ""),
            (-2.0, 0.5, "machine"),
        ];
        let poles = plane_of_kinds(camera(0.0), &dots);
        let lead = |words: &[Descriptor]| {
            let kinds = Kinds { words, trajectories: true };
            let all = Transitions::new(&poles, Window::on_land(land).unwrap(), kinds);
            let from = all.from(0).iter().filter(|it| it.corner == Corner::Sw && it.by_kind);
            let mut from: Vec<_> = from.map(|it| (it.to, it.candidates)).collect();
            from.sort_unstable();
            from
        };
        assert_eq!(lead(&[Descriptor::Isolated]), [(1, 1), (3, 1)]);
        assert_eq!(lead(&[Descriptor::Any]), [(1, 1), (3, 1), (5, 1)], "by their bearings");
    }

    /// The last pole is hidden by the one before it. Another one is in sight outside the quadrant.
    #[test]
    fn on_land_bearings_lead_to_every_pole_in_sight() {
        let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
        let poles = plane(&[(0.0, 0.0), (1.5, 4.0), (4.0, 4.0), (5.5, 1.5), (5.0, 5.0), (-2.0, 3.0)]);
        let lead = |words: &[Descriptor]| {
            let kinds = Kinds { words, trajectories: true };
            let all = Transitions::new(&poles, Window::on_land(land).unwrap(), kinds);
            let from = all.from(0).iter().filter(|it| it.corner == Corner::Sw);
            from.map(|it| (it.to, it.candidates)).collect::<Vec<_>>()
        };
        assert_eq!(lead(&[Descriptor::Isolated]).len(), 1);
        let mut by_bearing = lead(&[Descriptor::Any]);
        by_bearing.sort_unstable();
        assert_eq!(by_bearing, [(1, 1), (2, 1), (3, 1), (5, 1)]);
    }

    #[test]
    fn among_walls_a_robot_drives_around_a_landmark() {
        let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
        let window = Window::on_land(land).unwrap();
        let pair = plane(&[(0.0, 0.0), (3.0, 4.0)]);
        let kinds = Kinds { words: &[Descriptor::Any, Descriptor::Same], trajectories: true };
        let turns = |plane: &Plane| {
            let all = Transitions::new(plane, window, kinds);
            assert_eq!(all.attained_from(), [1, 1], "from the other landmark");
            all.all().filter(|(from, it)| it.to == *from).count()
        };
        assert_eq!(turns(&pair), 0);
        let wall = [Point::new(-9.0, -9.0), Point::new(9.0, -9.0)];
        let walls = Walls::new([wall], 0.1, Body { radius: 0.2, keeps: 0.35, merges: 0.4 });
        assert_eq!(turns(&pair.among(Arc::new(walls))), 8, "from each side of both");
    }

    #[test]
    fn what_is_filtered_is_gone() {
        let all = Transitions::new(&figure_13(), window(), Kinds::PAPER);
        let seeks = all.filtered(|_, entry| entry.movement == Movement::Seek);
        assert_eq!(seeks, Transitions::new(&figure_13(), window(), Kinds::ISOLATED));
    }
}
