//! A readable survey of what the map-maker knows about a plane: the transition matrix and the good landmarks (Park and Kender
//! 1995, 5.1, table 2). A survey covers either all parkways and trajectories, or only the reliable or checked ones (4.2.3,
//! 4.2.4, 4.6).

use std::fmt;

use crate::atlas::Atlas;
use crate::error::Error;
use crate::plane::DotId;
use crate::recovery::Check;
use crate::transitions::{Transition, Transitions};

/// The parkways and trajectories that a survey covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Parkways {
    /// All parkways and trajectories.
    All,
    /// Only those with at least this reliability (4.2.3).
    Reliable(f64),
    /// Only those on which errors are detected (4.2.4).
    Detectable,
    /// Only those on which errors are corrected (4.2.4).
    Recoverable,
}

/// The quantity in an entry of the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// The distance from landmark to landmark, in the plane's unit, as in table 2.
    Distance,
    /// The unreliability, −ln R.
    Unreliability,
}

/// A survey of a plane, showing which landmarks can be attained from which.
#[derive(Debug)]
pub struct Survey<'a> {
    atlas: &'a Atlas,
    transitions: Transitions,
}

impl<'a> Survey<'a> {
    /// Surveys the parkways and trajectories of this kind.
    pub fn new(atlas: &'a Atlas, parkways: Parkways) -> Result<Self, Error> {
        let transitions = match parkways {
            Parkways::All => atlas.transitions.clone(),
            Parkways::Reliable(least) => atlas.reliable(least),
            Parkways::Detectable => atlas.checked(Check::is_detectable)?,
            Parkways::Recoverable => atlas.checked(Check::is_recoverable)?,
        };
        Ok(Self { atlas, transitions })
    }

    /// Returns the transition matrix, with a row for each landmark of origin and a column for each target. Each entry is the
    /// lowest cost of a transition, or `None` if there is none.
    pub fn matrix(&self, cost: Cost) -> Vec<Vec<Option<f64>>> {
        let Self { atlas, transitions } = self;
        let cost = |from, transition: &Transition| match cost {
            Cost::Distance => atlas.landmark_distance(from, transition),
            Cost::Unreliability => {
                -atlas.reliability.of(&atlas.plane, atlas.window, from, transition).ln().min(0.0)
            }
        };
        let mut matrix = vec![vec![None; transitions.landmarks()]; transitions.landmarks()];
        for (from, transition) in transitions.all() {
            let entry: &mut Option<f64> = &mut matrix[from as usize][transition.to as usize];
            let cost = cost(from, transition);
            *entry = Some(entry.map_or(cost, |other| other.min(cost)));
        }
        matrix
    }

    /// Returns the matrix as comma-separated values, with the numbers of the landmarks in the first row and the first column.
    pub fn csv(&self, cost: Cost) -> String {
        let head: String = (0..self.transitions.landmarks()).map(|to| format!(",{to}")).collect();
        let row = |(from, row): (usize, Vec<Option<f64>>)| {
            let cell = |cost: Option<f64>| cost.map_or(",".to_owned(), |cost| format!(",{cost:.4}"));
            format!("\n{from}{}", row.into_iter().map(cell).collect::<String>())
        };
        let rows: String = self.matrix(cost).into_iter().enumerate().map(row).collect();
        format!("from{head}{rows}\n")
    }

    /// Returns all landmarks with the number of landmarks from which each is attained, best first (5.1).
    pub fn best_landmarks(&self) -> Vec<(DotId, u32)> {
        let mut landmarks: Vec<_> = (0..).zip(self.transitions.attained_from()).collect();
        landmarks.sort_by_key(|&(dot, from)| (std::cmp::Reverse(from), dot));
        landmarks
    }
}

/// Prints the landmarks, best first, followed by the numbers of transitions and components.
impl fmt::Display for Survey<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:>8} {:>10} {:>10} {:>13}", "LANDMARK", "X", "Y", "ATTAINED FROM")?;
        for (dot, from) in self.best_landmarks() {
            let place = self.atlas.plane.dot(dot);
            writeln!(f, "{dot:>8} {:>10.3} {:>10.3} {from:>13}", place.x, place.y)?;
        }
        let Self { transitions, .. } = self;
        let components = transitions.components().count();
        let (landmarks, count) = (transitions.landmarks(), transitions.count());
        writeln!(f, "{landmarks} landmarks, {count} transitions, {components} strongly connected components")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Window;
    use crate::reliability::Reliability;
    use crate::testing::plane;
    use crate::transitions::Kinds;
    use crate::traversal::Noise;

    /// Figure 13 in miniature: A, B and C see each other, as do D and E. The only trajectories lead from D and E to C.
    fn atlas() -> Atlas {
        let plane = plane(&[(0.0, 0.0), (6.0, 3.0), (8.0, 9.0), (40.0, 9.0), (47.0, 9.5)]);
        let model = Reliability::fitted(Noise::of_sigma(0.1));
        Atlas::new(plane, Window::new(10.0, 0.0).unwrap(), Kinds::PAPER, model)
    }

    #[test]
    fn table_2_has_an_entry_for_each_transition_and_a_column_that_is_filled_is_a_good_landmark() {
        let atlas = atlas();
        let survey = Survey::new(&atlas, Parkways::All).unwrap();
        let matrix = survey.matrix(Cost::Distance);
        assert_eq!(matrix[3][4], Some(7.0_f64.hypot(0.5)));
        assert_eq!((matrix[3][2], matrix[2][3], matrix[0][0]), (Some(32.0), None, None));
        let filled =
            |column: DotId| matrix.iter().filter(|row| row[column as usize].is_some()).count() as u32;
        let best = survey.best_landmarks();
        assert!(best.iter().all(|&(dot, from)| filled(dot) == from), "{best:?}");
        assert_eq!(best[0].0, 2, "C is attained from both parkways");
        let csv = survey.csv(Cost::Distance);
        assert!(csv.starts_with("from,0,1,2,3,4\n0,") && csv.contains("\n3,,,32.0000,,7.0178\n"), "{csv}");
        // Seeking leads from A to C and back, from B to both, and from D and E to each other. Sliding leads from B away from C
        // to A, from B away from A to C, and from D and E to C. Nothing leads to B.
        assert!(
            survey.to_string().ends_with("5 landmarks, 10 transitions, 3 strongly connected components\n"),
            "{survey}"
        );
    }

    #[test]
    fn reliable_and_checked_parkways_are_a_part_of_all() {
        let atlas = atlas();
        let count = |parkways| Survey::new(&atlas, parkways).unwrap().transitions.count();
        let all = count(Parkways::All);
        assert_eq!(count(Parkways::Reliable(0.0)), all);
        assert!(count(Parkways::Reliable(0.99)) < all);
        assert!(count(Parkways::Recoverable) <= count(Parkways::Detectable));
        let survey = Survey::new(&atlas, Parkways::All).unwrap();
        let costs: Vec<_> = survey.matrix(Cost::Unreliability).concat().into_iter().flatten().collect();
        assert!(costs.iter().all(|&cost| cost >= 0.0) && costs.iter().any(|&cost| cost > 0.0), "{costs:?}");
    }
}
