//! The words `New` and `Confusable`, which depend on what comes before or after in the path (Park and Kender 1995, 5.6).
//!
//! Whether a landmark is *new* depends on what the window showed when the reference was chosen. Whether landmarks are *confusable*
//! depends on where the path leads from each of them. Neither word can therefore be a property of a single transition. Instead,
//! they replace other words in a path that has already been found.

use crate::description::{Descriptor, Vocabulary};
use crate::path::{Atlas, Leg, Path, unreliability};
use crate::plane::DotId;
use crate::transitions::{Candidates, Movement};

/// Returns the path with `New` and `Confusable` wherever they apply and the navigator understands them. Dots within `slack` of
/// the edge of the earlier view are neither certainly new nor certainly old.
///
/// A new landmark is the only candidate, and any of the confusable landmarks is right. By equation 1, both are therefore as certain
/// as a single candidate.
pub fn reworded(atlas: &Atlas, path: &Path, vocabulary: Vocabulary, slack: f64) -> Path {
    let mut reworded = path.clone();
    for index in (0..path.legs.len()).rev() {
        let leg = &path.legs[index];
        // Landmarks of all kinds count when deciding whether one is new or confusable.
        if leg.transition.by_kind {
            continue;
        }
        let before = index.checked_sub(1).map(|before| &path.legs[before]);
        // The leg after a confusable landmark must keep its word, because the check for confusability has used that word from
        // each candidate. The leg after that must not be `New`, since what is new there depends on which candidate was chosen.
        let word_at = |at: usize| reworded.legs.get(at).map(|leg| leg.transition.word);
        let next = path.legs.get(index + 1).filter(|next| {
            word_at(index + 1) == Some(next.transition.word) && word_at(index + 2) != Some(Descriptor::New)
        });
        let word =
            if vocabulary.has(Descriptor::New) && before.is_some_and(|it| is_new(atlas, it, leg, slack)) {
                Descriptor::New
            } else if vocabulary.has(Descriptor::Confusable)
                && next.is_some_and(|it| are_confusable(atlas, leg, it))
            {
                Descriptor::Confusable
            } else {
                continue;
            };
        reworded.legs[index].transition.word = word;
        reworded.legs[index].unreliability = 0.0;
    }
    reworded.unreliability = unreliability(&reworded.legs);
    reworded
}

/// Returns true if the landmark of a leg is the only one of several candidates that the last movement brought into view.
fn is_new(atlas: &Atlas, before: &Leg, leg: &Leg, slack: f64) -> bool {
    let is_seek = |leg: &Leg| leg.transition.movement == Movement::Seek;
    if !is_seek(before) || !is_seek(leg) || leg.transition.word == Descriptor::Same {
        return false;
    }
    let (old, now) = (candidates(atlas, before), candidates(atlas, leg));
    let reference = atlas.plane.dot(before.from);
    let is_old = |dot: DotId| dot == before.from || old.dots.contains(&dot);
    let is_sure = |dot: DotId| {
        let slack = if is_old(dot) { -slack } else { slack };
        let relative = atlas.plane.dot(dot) - reference;
        let covers = before.transition.corner.nearly_covers(relative, atlas.window.side, slack);
        // A robot on land sees a quadrant only up to its range.
        let away = (relative - atlas.window.centre_from(before.transition.corner)).norm();
        let is_near = atlas.window.land.is_none_or(|land| away <= land.range + slack);
        dot == before.from || (covers && is_near) == is_old(dot)
    };
    now.dots.len() > 1
        && now.dots.iter().all(|&dot| is_sure(dot))
        && now.dots.iter().filter(|&&dot| !is_old(dot)).eq([&leg.transition.seen])
}

/// Returns true if the next leg leads to the same landmark from each of several candidates.
fn are_confusable(atlas: &Atlas, leg: &Leg, next: &Leg) -> bool {
    let (onward, now) = (next.transition, candidates(atlas, leg));
    // The bearing to the same landmark differs from candidate to candidate, and the reference itself cannot be confused with
    // another landmark.
    if onward.word == Descriptor::Any || leg.transition.word == Descriptor::Same {
        return false;
    }
    let leads = |dot: DotId| {
        let mut transitions = atlas.transitions.from(dot).iter();
        transitions.any(|it| {
            (it.corner, it.word, it.by_kind, it.movement, it.to)
                == (onward.corner, onward.word, onward.by_kind, onward.movement, onward.to)
        })
    };
    leg.transition.movement == Movement::Seek && now.dots.len() > 1 && now.dots.iter().all(|&dot| leads(dot))
}

fn candidates(atlas: &Atlas, leg: &Leg) -> Candidates {
    let mut candidates = Candidates::default();
    candidates.find(&atlas.plane, atlas.window, leg.from, leg.transition.corner);
    candidates
}

#[cfg(test)]
mod tests {
    use sketchnav_schemas::seed::stream;

    use super::*;
    use crate::custom_map::CustomMap;
    use crate::generate::uniform;
    use crate::geometry::{Land, Point, Window};
    use crate::navigator::{Navigator, Settings};
    use crate::path::{Measure, Objective, Start, best};
    use crate::plan::{Plan, Verify};
    use crate::plane::Plane;
    use crate::reliability::Reliability;
    use crate::testing::plane;
    use crate::transitions::Kinds;
    use crate::traversal::{Kind, Noise, Report, Traversal};

    fn window() -> Window {
        Window::new(10.0, 1.5).unwrap()
    }

    fn atlas(plane: Plane, window: Window) -> Atlas {
        let words = [Descriptor::Isolated, Descriptor::IsolatedPair];
        let kinds = Kinds { words: &words, trajectories: true };
        Atlas::new(plane, window, kinds, Reliability::fitted(Noise::NONE))
    }

    /// Returns the shortest path, with `New` and `Confusable` where they apply.
    fn path(atlas: &Atlas, from: DotId, to: DotId, slack: f64) -> Option<Path> {
        let start = Start::over(&atlas.plane, from).unwrap();
        let path = best(atlas, start, to, Measure::Windows, Objective::SHORTEST).ok()?;
        Some(reworded(atlas, &path, Vocabulary::ALL, slack))
    }

    fn words(path: &Path) -> Vec<Descriptor> {
        path.legs.iter().map(|leg| leg.transition.word).collect()
    }

    fn follow(world: &Plane, window: Window, map: &CustomMap, meant: &[DotId], start: Start) -> Report {
        let usual = Settings::new(window, 0.0);
        let settings = Settings { speed: window.land.map_or(usual.speed, |_| 0.5), ..usual };
        let navigator = Navigator::new(settings, map.clone()).unwrap();
        let journey = Traversal::new(world, &navigator, meant, Noise::NONE).unwrap();
        journey.run(start.centre, &mut stream(1, "journey"), |_, _, _| {})
    }

    /// The start lies in the south-west of the window, and the isolated dot is the third one. From there, the pair is already
    /// known, and the last dot is new.
    const ONWARD: [(f64, f64); 5] = [(0.0, 0.0), (4.0, 1.0), (8.0, 8.0), (8.5, 8.5), (13.0, 3.0)];

    #[test]
    fn a_landmark_that_the_last_movement_brought_in_is_new() {
        let atlas = atlas(plane(&ONWARD), window());
        let reworded = path(&atlas, 0, 4, 0.5).unwrap();
        assert_eq!(words(&reworded), [Descriptor::Isolated, Descriptor::New]);
        assert_eq!(reworded.legs[1].unreliability, 0.0);
        // The pair lies 1.5 from the edge of the first view, which is too close for larger errors.
        assert_eq!(words(&path(&atlas, 0, 4, 2.0).unwrap()), [Descriptor::Isolated; 2]);
    }

    #[test]
    fn two_new_landmarks_are_none() {
        let two = plane(&[&ONWARD[..], &[(13.5, 8.0)]].concat());
        let atlas = atlas(two, window());
        for goal in 1..6 {
            let all = path(&atlas, 0, goal, 0.1).map(|path| words(&path)).unwrap_or_default();
            assert!(!all.contains(&Descriptor::New), "{goal}: {all:?}");
        }
    }

    /// The new landmark lies beside an old one, and a third dot is the most isolated, so only `New` means the new landmark.
    #[test]
    fn the_navigator_finds_a_new_landmark_that_no_other_word_means() {
        let world = plane(&[(0.0, 0.0), (4.0, 1.0), (5.0, 9.5), (9.6, 4.0), (11.0, 4.2)]);
        let start = Start::over(&world, 0).unwrap();
        let to = |word: &str| {
            let map = format!("(*, SW)\n(*, SW)\n({word}, -)").parse().unwrap();
            *follow(&world, window(), &map, &[0, 1, 4], start).attained.last().unwrap()
        };
        assert_eq!((to("New"), to("Isol"), to("*")), (4, 2, 3));
    }

    #[test]
    fn landmarks_that_lead_to_the_same_are_confusable_and_any_of_them_is_right() {
        // From either of two dots, the same third dot is the only one in view.
        let fork = plane(&[(0.0, 0.0), (5.0, 2.0), (2.0, 5.5), (11.0, 11.5)]);
        let atlas = atlas(fork, window());
        let reworded = path(&atlas, 0, 3, 0.5).unwrap();
        assert_eq!(words(&reworded), [Descriptor::Confusable, Descriptor::Isolated]);
        let plan = Plan::new(&atlas, reworded, Verify::Detectable).unwrap();
        assert_eq!(plan.map.to_string(), "(*, SW)\n(Confusable, SW)\n(Isol, -)\n");
        for meant in [[0, 1, 3], [0, 2, 3]] {
            let report = follow(&atlas.plane, window(), &plan.map, &meant, plan.path.start);
            assert_eq!((report.kind, report.attained.len()), (Kind::Direct, 3), "{report:?}");
        }
    }

    #[test]
    fn a_navigator_is_told_no_word_that_it_lacks() {
        let atlas = atlas(plane(&ONWARD), window());
        let start = Start::over(&atlas.plane, 0).unwrap();
        let path = best(&atlas, start, 4, Measure::Windows, Objective::SHORTEST).unwrap();
        let knows = Vocabulary::of(&[Descriptor::Any, Descriptor::Isolated, Descriptor::Confusable]);
        assert_eq!(reworded(&atlas, &path, knows, 0.5), path);
    }

    /// Counts over the plans that are followed directly in their original words: occurrences of each of the two words, the number
    /// of plans, and the number of those that are also followed directly in the new words.
    struct Agreement {
        new: usize,
        confusable: usize,
        plans: usize,
        direct: usize,
    }

    /// Without errors, the navigator should read each view as the map-maker did, and go from landmark to landmark as planned.
    fn agreement(window: Window, slack: f64, worlds: impl Iterator<Item = Plane>) -> Agreement {
        let mut all = Agreement { new: 0, confusable: 0, plans: 0, direct: 0 };
        for world in worlds {
            let atlas = atlas(world, window);
            for goal in [5, 17, 33, 41, 55, 73] {
                let Some(reworded) = path(&atlas, 2, goal, slack) else { continue };
                let of = |word| words(&reworded).into_iter().filter(|it| *it == word).count();
                let (new, confusable) = (of(Descriptor::New), of(Descriptor::Confusable));
                if new + confusable == 0 {
                    continue;
                }
                let plan = Plan::new(&atlas, reworded, Verify::Nothing).unwrap();
                let read: CustomMap = plan.map.to_string().parse().unwrap();
                assert_eq!(read, plan.map);
                let is_direct = |map: &CustomMap| {
                    let (meant, start) = (plan.landmarks(), plan.path.start);
                    follow(&atlas.plane, window, map, &meant, start).kind == Kind::Direct
                };
                let start = plan.path.start;
                let plain = best(&atlas, start, goal, Measure::Windows, Objective::SHORTEST).unwrap();
                if !is_direct(&Plan::new(&atlas, plain, Verify::Nothing).unwrap().map) {
                    continue;
                }
                (all.new, all.confusable) = (all.new + new, all.confusable + confusable);
                (all.plans, all.direct) = (all.plans + 1, all.direct + usize::from(is_direct(&read)));
            }
        }
        all
    }

    #[test]
    fn what_the_map_maker_calls_new_and_confusable_the_navigator_finds() {
        let all =
            agreement(window(), 0.06 * window().side, (0..40).map(|seed| uniform(150, 100.0, seed).unwrap()));
        assert!(all.new > 20 && all.confusable > 20, "{} {}", all.new, all.confusable);
        assert!(all.plans > 60 && all.direct == all.plans, "{} of {}", all.direct, all.plans);
    }

    /// The same holds on land, except that the robot never stands exactly at its intended position, so poles occasionally hide
    /// others.
    #[test]
    fn on_land_a_new_pole_is_found() {
        let land = Land { radius: 0.15, range: 8.0, stand_off: 0.8, clearance: 0.5 };
        let field = |seed| {
            let mut apart: Vec<Point> = Vec::new();
            for &place in uniform(140, 36.0, seed).unwrap().dots() {
                if apart.iter().all(|other| (*other - place).norm() > 1.6) {
                    apart.push(place);
                }
            }
            Plane::new(apart).unwrap()
        };
        let window = Window::on_land(land).unwrap();
        let all = agreement(window, Settings::new(window, 0.0).gate, (0..24).map(field));
        assert!(all.new > 3, "{}", all.new);
        assert!(all.direct * 10 >= all.plans * 9, "{} of {}", all.direct, all.plans);
    }
}
