//! Converts a path to a custom map, with its costs and the errors that it can recover from (Park and Kender 1995, 5.5, figure 30).

use std::fmt;

use crate::custom_map::{CustomMap, Direction, Entry, Sign, Verification};
use crate::description::Descriptor;
use crate::error::Error;
use crate::geometry::Corner;
use crate::orientation::Around;
use crate::path::{Atlas, Leg, Path};
use crate::plane::DotId;
use crate::recovery::Check;
use crate::transitions::Movement;

/// The errors that a map allows the navigator to notice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verify {
    /// No errors, since nothing is verified.
    Nothing,
    /// Only the errors that can be corrected.
    Recoverable,
    /// All errors that can be noticed. If one cannot be corrected, the navigator knows that it is lost.
    Detectable,
}

/// A path with its custom map.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The path.
    pub path: Path,
    /// The check for errors of each leg.
    pub checks: Vec<Check>,
    /// The custom map of the path.
    pub map: CustomMap,
    /// The landmarks that the map refers to, one for each entry: the landmark at which the next entry begins or, for the last
    /// entry, the goal.
    pub landmarks: Vec<DotId>,
    /// The probability of arrival, if it was estimated.
    pub probability: Option<f64>,
    /// The entry at which most simulated journeys failed, if any did.
    pub weakest: Option<Weakest>,
}

/// The entry of a map at which most simulated journeys fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Weakest {
    /// Number of the entry, from 0.
    pub entry: u16,
    /// Number of journeys that failed there.
    pub failures: u32,
    /// Total number of journeys.
    pub journeys: u32,
}

impl Plan {
    /// Creates the map of a path. Its first entry is `*`, for the landmark under the window.
    pub fn new(atlas: &Atlas, path: Path, verify: Verify) -> Result<Self, Error> {
        Self::choosing(atlas, path, |_, check| match verify {
            Verify::Nothing => false,
            Verify::Recoverable => check.is_recoverable(),
            Verify::Detectable => true,
        })
    }

    /// Creates the map of a path. `verifies` decides which legs are verified, among those that can be.
    pub fn choosing(
        atlas: &Atlas,
        path: Path,
        verifies: impl Fn(&Leg, Check) -> bool,
    ) -> Result<Self, Error> {
        let recoveries = atlas.recoveries()?;
        let check = |leg: &Leg| {
            let aside = atlas.reliability.aside(&atlas.plane, leg.from, &leg.transition);
            recoveries.check(leg.from, &leg.transition, aside)
        };
        let checks: Vec<_> = path.legs.iter().map(check).collect();
        let first = Entry {
            kind: None,
            word: Descriptor::Any,
            bearing_deg: None,
            trajectory: None,
            verification: None,
            place: path.legs.first().map(|leg| leg.transition.corner),
        };
        let entry = |(leg, &check): (&Leg, &Check)| {
            // Confusable landmarks are not verified, because any of them will do.
            let is_definite = leg.transition.word != Descriptor::Confusable;
            // To verify a landmark, the navigator has to go around it.
            let can_be_verified = is_definite && atlas.is_free_around(leg.transition.to);
            let verification = check.verification().filter(|_| can_be_verified && verifies(leg, check));
            entry(atlas, leg, verification)
        };
        let others = path.legs.iter().zip(&checks).map(entry);
        let map = CustomMap::new(std::iter::once(first).chain(others).collect())?;
        let map = match atlas.window.land.filter(|_| path.start.faces_anywhere) {
            Some(land) => map.starting_among(Around::at(&atlas.plane, land, path.start.centre)?),
            None => map,
        };
        let landmarks = path.landmarks();
        Ok(Self { path, checks, map, landmarks, probability: None, weakest: None })
    }

    /// Returns the sensing cost S (5.3): the views of the path ([`Path::sensing`]), and one view of each quadrant for each
    /// verification.
    pub fn sensing(&self) -> f64 {
        let verified = self.map.entries().iter().filter(|entry| entry.verification.is_some()).count();
        self.path.sensing() + (Corner::ALL.len() * verified) as f64
    }

    /// Returns the landmarks that the map refers to, one for each entry.
    pub fn landmarks(&self) -> Vec<DotId> {
        self.landmarks.clone()
    }

    /// Returns a printable table like that of figure 30, followed by the path's costs.
    pub fn itinerary(&self) -> Itinerary<'_> {
        Itinerary(self)
    }
}

fn entry(atlas: &Atlas, leg: &Leg, verification: Option<Verification>) -> Entry {
    let trajectory = match leg.transition.movement {
        Movement::Seek => None,
        Movement::Forward => Some(Direction::Forward),
        Movement::Backward => Some(Direction::Backward),
    };
    let bearing_deg = atlas.bearing_deg(leg.from, &leg.transition);
    let kind = atlas.kind(&leg.transition);
    Entry { kind, word: leg.transition.word, bearing_deg, trajectory, verification, place: leg.place }
}

/// Prints a plan in the form of figure 30 or, for a branching map, the successors of each entry.
#[derive(Debug, Clone, Copy)]
pub struct Itinerary<'a>(&'a Plan);

impl fmt::Display for Itinerary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.map.branches() {
            return graph(f, self.0);
        }
        // The first entry of the map belongs to no leg.
        let commands: Vec<_> = self.0.map.entries()[1..].iter().map(command).collect();
        let width = commands.iter().map(String::len).max().unwrap_or_default().max(10);
        writeln!(
            f,
            "{:>7} {:>7} {:<width$} {:>10} {:>8}  VERIFY",
            "FROM", "TO", "CMD", "DISTANCE", "-LOGPROB"
        )?;
        for ((leg, &check), command) in self.0.path.legs.iter().zip(&self.0.checks).zip(&commands) {
            let (from, to) = (leg.from, leg.transition.to);
            write!(
                f,
                "{from:>7} {to:>7} {command:<width$} {:>10.3} {:>8.3}  ",
                leg.distance, leg.unreliability
            )?;
            verification(f, check)?;
        }
        let path = &self.0.path;
        write!(
            f,
            "distance {:.3}, -log R {:.3}, D/R {:.3}",
            path.distance,
            path.unreliability,
            path.ratio()
        )?;
        match self.0.probability {
            Some(probability) => writeln!(f, ", probability of arrival {probability:.3}"),
            None => writeln!(f),
        }
    }
}

/// Returns the command of an entry, as figure 30 writes it, after the kind of landmark that it is about.
fn command(entry: &Entry) -> String {
    let kind = entry.kind.map_or(String::new(), |kind| format!("{kind} "));
    format!("{kind}{}", entry.trajectory.map_or(entry.word.word(), Direction::word)).to_uppercase()
}

/// Prints, for each entry, the landmark at which it begins, the landmark that it seeks, and for each sign the landmark and the
/// entry at which the journey continues.
fn graph(f: &mut fmt::Formatter<'_>, Plan { map, landmarks, probability, .. }: &Plan) -> fmt::Result {
    writeln!(f, "{:>7} {:>7} {:<10}  LEADS TO", "ENTRY", "FROM", "CMD")?;
    let goal = landmarks.last().copied().unwrap_or_default();
    // The landmark of a branch back to the first entry is unknown.
    let begins = |entry: usize| entry.checked_sub(1).and_then(|before| landmarks.get(before)).copied();
    for (index, entry) in map.entries().iter().enumerate() {
        let from = begins(index).map_or("-".to_owned(), |dot| dot.to_string());
        let command = command(entry);
        write!(f, "{:>7} {from:>7} {command:<10} ", index + 1)?;
        if let Some(signs) = entry.verification {
            for (sign, branch) in signs.branches() {
                let (entry, dot) = (usize::from(branch.entry), begins(usize::from(branch.entry)));
                write!(f, " {sign}: {} at {};", dot.unwrap_or_default(), entry + 1)?;
            }
        }
        let right = match entry.place {
            Some(_) => begins(index + 1).map(|dot| format!(" {dot} at {}", index + 2)),
            None if entry.verification.is_none_or(Verification::accepts) => {
                Some(format!(" {goal}, the goal"))
            }
            None => None,
        };
        writeln!(f, "{}", right.unwrap_or_default())?;
    }
    match probability {
        Some(probability) => writeln!(f, "probability of arrival {probability:.3}"),
        None => Ok(()),
    }
}

fn verification(f: &mut fmt::Formatter<'_>, check: Check) -> fmt::Result {
    let name = match check {
        Check::Trivial => return writeln!(f, "TRIVIAL CASE"),
        Check::Unverifiable => return writeln!(f, "UNVERIFIABLE (NOT CORRECTABLE)"),
        Check::Recoverable(_) => "CORRECTABLE",
        Check::Detectable(_) => "DETECTABLE",
    };
    let Some(verification) = check.verification() else { return writeln!(f) };
    let expected = verification.expected().unwrap_or(Sign::Other);
    write!(f, "QOC -> {expected} ({name})")?;
    for (count, recovery) in verification.recoveries() {
        write!(
            f,
            "; IF QOC -> {count} ({}, {})",
            recovery.corner.word(),
            recovery.word.word().to_uppercase()
        )?;
    }
    writeln!(f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::uniform;
    use crate::geometry::Window;
    use crate::navigator::{Navigator, Settings};
    use crate::path::{Measure, Objective, Start, best};
    use crate::reliability::Reliability;
    use crate::transitions::Kinds;
    use crate::traversal::{Kind, Noise, STEP_S, Traversal};
    use sketchnav_schemas::seed::stream;

    fn atlas(seed: u64, kinds: Kinds<'_>, sigma: f64) -> Atlas {
        let window = Window::new(100.0, 15.0).unwrap();
        Atlas::new(
            uniform(100, 1000.0, seed).unwrap(),
            window,
            kinds,
            Reliability::fitted(Noise::of_sigma(sigma)),
        )
    }

    fn plan(atlas: &Atlas, from: DotId, to: DotId, objective: Objective, verify: Verify) -> Option<Plan> {
        let start = Start::over(&atlas.plane, from).unwrap();
        let path = best(atlas, start, to, Measure::Windows, objective).ok()?;
        Some(Plan::new(atlas, path, verify).unwrap())
    }

    /// Without errors, the navigator follows every plan of the map-maker, and flies exactly as far as planned.
    #[test]
    fn without_errors_every_plan_arrives_directly() {
        let words = [Descriptor::Isolated, Descriptor::IsolatedPair, Descriptor::PlusPair];
        let kinds =
            [Kinds::PAPER, Kinds { words: &words, trajectories: true }, Kinds::ISOLATED, Kinds::OBVIOUS];
        let mut arrived = 0;
        for seed in 0..12 {
            for kinds in kinds {
                let atlas = atlas(seed, kinds, 0.0);
                for goal in [17, 55, 93] {
                    let Some(plan) = plan(&atlas, 2, goal, Objective::SHORTEST, Verify::Detectable) else {
                        continue;
                    };
                    let settings = Settings::new(atlas.window, 0.0);
                    let navigator = Navigator::new(settings, plan.map.clone()).unwrap();
                    let landmarks = plan.landmarks();
                    let journey = Traversal::new(&atlas.plane, &navigator, &landmarks, Noise::NONE).unwrap();
                    let report =
                        journey.run(plan.path.start.centre, &mut stream(seed, "journey"), |_, _, _| {});
                    assert_eq!(
                        report.kind,
                        Kind::Direct,
                        "{seed} {goal} {report:?}\n{}{}",
                        plan.map,
                        plan.itinerary()
                    );
                    arrived += 1;
                }
            }
        }
        assert!(arrived > 50, "{arrived}");
    }

    #[test]
    fn without_verification_it_flies_as_far_and_as_long_as_planned() {
        let atlas = atlas(3, Kinds::PAPER, 0.0);
        let plan = (0..100)
            .filter_map(|goal| plan(&atlas, 2, goal, Objective::SHORTEST, Verify::Nothing))
            .max_by_key(|plan| plan.path.legs.len())
            .unwrap();
        let navigator = Navigator::new(Settings::new(atlas.window, 0.0), plan.map.clone()).unwrap();
        let landmarks = plan.landmarks();
        let journey = Traversal::new(&atlas.plane, &navigator, &landmarks, Noise::NONE).unwrap();
        let report = journey.run(plan.path.start.centre, &mut stream(1, "journey"), |_, _, _| {});
        let (flown, planned) = (report.distance, plan.path.distance);
        assert!((flown / planned - 1.0).abs() < 0.1, "{flown} {planned}");
        let (flown_s, planned_s) = (f64::from(report.steps) * STEP_S, plan.path.time_s(navigator.settings()));
        assert!((flown_s / planned_s - 1.0).abs() < 0.1, "{flown_s} {planned_s}");
        assert_eq!(plan.sensing(), plan.path.sensing());
        assert!(plan.map.entries().iter().all(|entry| entry.verification.is_none()));
    }

    #[test]
    fn an_itinerary_reads_like_figure_30() {
        let atlas = atlas(1, Kinds::PAPER, 3.0);
        let plan = (0..100)
            .filter_map(|goal| plan(&atlas, 5, goal, Objective::Ratio, Verify::Recoverable))
            .max_by_key(|plan| plan.path.legs.len())
            .unwrap();
        let text = Plan { probability: Some(0.9), ..plan.clone() }.itinerary().to_string();
        assert_eq!(text.lines().count(), plan.path.legs.len() + 2, "{text}");
        assert!(text.starts_with("   FROM      TO CMD"), "{text}");
        assert!(
            text.contains("ISOL") && text.contains("TRIVIAL CASE") && text.contains("CORRECTABLE"),
            "{text}"
        );
        assert!(text.trim_end().ends_with("probability of arrival 0.900"), "{text}");
        assert_eq!(plan.map.to_string().parse::<CustomMap>().unwrap(), plan.map);
        let verified = plan.map.entries().iter().filter(|entry| entry.verification.is_some()).count();
        assert!(verified > 0 && plan.sensing() == plan.path.sensing() + 4.0 * verified as f64, "{text}");
    }
}
