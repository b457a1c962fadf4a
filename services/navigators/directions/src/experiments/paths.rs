//! Figures 14, 15, 26 and 27 and section 5.3: the costs of paths over many worlds, mostly as ratios, which don't depend on the
//! scale of a figure.

use std::ops::Range;

use super::{DOTS, SIDE, Table, window};
use crate::error::Error;
use crate::generate::uniform;
use crate::navigator::Settings;
use crate::path::{Atlas, Measure, Objective, Path, Start, best};
use crate::plane::DotId;
use crate::reliability::Reliability;
use crate::transitions::Kinds;
use crate::traversal::Noise;

/// The position error of the paper's camera, which is the root mean square of σx and σy (6.1.1), in millimetres.
pub const CAMERA_SIGMA: f64 = 1.3;
/// Distance that the window travels on the shortest path of figure 14, in millimetres (7.2.2).
pub const PUBLISHED_WAY: f64 = 444.93;

/// The choice of the goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// The dot whose shortest path has a length closest to this one, in millimetres.
    At(f64),
    /// The dot with the longest shortest path.
    Furthest,
}

/// A world with a start and a goal.
struct World {
    atlas: Atlas,
    start: Start,
    goal: DotId,
}

impl World {
    /// Creates a world in which the map has no errors. Returns `None` if no path leads anywhere.
    fn new(seed: u64, goal: Goal) -> Result<Option<Self>, Error> {
        let plane = uniform(DOTS, SIDE, seed)?;
        let atlas = Atlas::new(plane, window()?, Kinds::PAPER, Reliability::fitted(Noise::NONE));
        let start = Start::over(&atlas.plane, 0)?;
        Ok(goal_of(&atlas, start, goal).map(|goal| Self { atlas, start, goal }))
    }

    /// Returns the same world for a map-maker that takes position errors into account.
    fn with_sigma(&self, sigma: f64) -> Self {
        let atlas = &self.atlas;
        let model = Reliability::fitted(Noise::of_sigma(sigma));
        Self { atlas: Atlas::new(atlas.plane.clone(), atlas.window, Kinds::PAPER, model), ..*self }
    }

    fn path(&self, measure: Measure, objective: Objective) -> Result<Path, Error> {
        best(&self.atlas, self.start, self.goal, measure, objective)
    }

    /// Returns the shortest, the most reliable and the D/R path, measured by the distance that the window travels.
    fn three(&self) -> Result<[Path; 3], Error> {
        let path = |objective| self.path(Measure::Windows, objective);
        Ok([path(Objective::SHORTEST)?, path(Objective::MOST_RELIABLE)?, path(Objective::Ratio)?])
    }
}

fn goal_of(atlas: &Atlas, start: Start, goal: Goal) -> Option<DotId> {
    let path = |goal| best(atlas, start, goal, Measure::Windows, Objective::SHORTEST).ok();
    let paths = (0..atlas.plane.len() as DotId).filter_map(|goal| Some((goal, path(goal)?.distance)));
    let off = |distance: f64| match goal {
        Goal::At(length) => (distance - length).abs(),
        Goal::Furthest => -distance,
    };
    let reached = paths.filter(|(_, distance)| *distance > 0.0);
    reached.min_by(|a, b| off(a.1).total_cmp(&off(b.1))).map(|(goal, _)| goal)
}

/// Samples from many worlds, grouped by the name of the quantity.
#[derive(Default)]
struct Samples(Vec<(&'static str, Vec<f64>)>);

impl Samples {
    fn add(&mut self, name: &'static str, number: f64) {
        match self.0.iter_mut().find(|(known, _)| *known == name) {
            Some((_, numbers)) => numbers.push(number),
            None => self.0.push((name, vec![number])),
        }
    }
}

/// Returns the quantities of figures 14, 15, 26 and 27, which show one world each, over many worlds. Means have Student's
/// confidence intervals, and shares of worlds, in percent, have Wilson's.
pub fn paths(goal: Goal, worlds: Range<u64>) -> Result<Table, Error> {
    let (mut means, mut shares) = (Samples::default(), Samples::default());
    for seed in worlds {
        let Some(world) = World::new(seed, goal)? else { continue };
        three_costs(&world, &mut means)?;
        accuracies(&world, &mut means, &mut shares)?;
        contexts(&world, &mut means, &mut shares)?;
        views_and_time(&world, &mut means, &mut shares)?;
    }
    let what = match goal {
        Goal::At(length) => format!("{length} mm"),
        Goal::Furthest => "as far as a path leads".to_owned(),
    };
    let title = format!("Figures 14, 15, 26 and 27, section 5.3: the goal {what} away");
    let mut table = Table::new(&title, &["quantity", "value", "low", "high", "worlds"]);
    means.0.iter().for_each(|(name, numbers)| table.row(name, &Table::mean_of(numbers)));
    shares.0.iter().for_each(|(name, hits)| table.share(name, hits.iter().sum::<f64>() as usize, hits.len()));
    Ok(table)
}

/// Adds the quantities of figures 14 and 15.
fn three_costs(world: &World, means: &mut Samples) -> Result<(), Error> {
    let [short, sure, ratio] = world.with_sigma(CAMERA_SIGMA).three()?;
    means.add("14: D of the shortest path", short.distance);
    means.add("14: D of the most reliable path over the shortest", sure.distance / short.distance);
    means.add("15: D of the D/R path over the shortest", ratio.distance / short.distance);
    means.add("14: -ln R of the shortest path", short.unreliability);
    means.add("14: -ln R of the most reliable path", sure.unreliability);
    means.add("15: -ln R of the D/R path", ratio.unreliability);
    Ok(())
}

/// Adds the quantities of figure 26. Whether the D/R path is closer to the shortest or to the most reliable path is judged by
/// D. A world in which these two have the same D is left out.
fn accuracies(world: &World, means: &mut Samples, shares: &mut Samples) -> Result<(), Error> {
    let [accurate, inaccurate] = [1.0, 5.0].map(|sigma| world.with_sigma(sigma).three());
    let (accurate, inaccurate) = (accurate?, inaccurate?);
    means.add("26: D of the D/R path at 5 mm over 1 mm", inaccurate[2].distance / accurate[2].distance);
    means.add("26: -ln R of the D/R path at 1 mm", accurate[2].unreliability);
    means.add("26: -ln R of the D/R path at 5 mm", inaccurate[2].unreliability);
    let names = [
        (
            "26: at 1 mm, from the shortest (0) to the most reliable path (1) by D",
            "26: nearer the shortest path at 1 mm, %",
        ),
        (
            "26: at 5 mm, from the shortest (0) to the most reliable path (1) by D",
            "26: nearer the shortest path at 5 mm, %",
        ),
    ];
    for ([short, sure, ratio], (place, nearer)) in [accurate, inaccurate].iter().zip(names) {
        if sure.distance > short.distance {
            let along = (ratio.distance - short.distance) / (sure.distance - short.distance);
            means.add(place, along);
            shares.add(nearer, f64::from(u8::from(along < 0.5)));
        }
    }
    Ok(())
}

/// Adds the quantities of figure 27, which compares the shortest path by landmarks with the shortest path by windows.
fn contexts(world: &World, means: &mut Samples, shares: &mut Samples) -> Result<(), Error> {
    let by_landmarks = world.path(Measure::Landmarks, Objective::SHORTEST)?;
    let by_windows = world.path(Measure::Windows, Objective::SHORTEST)?;
    let over = |measure| {
        by_windows.distance_by(&world.atlas, measure) / by_landmarks.distance_by(&world.atlas, measure)
    };
    means.add("27: D by landmarks, context-based path over landmark path", over(Measure::Landmarks));
    means.add("27: D by windows, context-based path over landmark path", over(Measure::Windows));
    let differ = by_windows.landmarks() != by_landmarks.landmarks();
    shares.add("27: the two paths differ, %", f64::from(u8::from(differ)));
    Ok(())
}

/// Adds the costs S and T of section 5.3.
fn views_and_time(world: &World, means: &mut Samples, shares: &mut Samples) -> Result<(), Error> {
    let settings = Settings::new(world.atlas.window, CAMERA_SIGMA);
    let shortest = world.path(Measure::Windows, Objective::SHORTEST)?;
    let quickest = world.path(Measure::Windows, Objective::quickest(&settings))?;
    let fewest = world.path(Measure::Windows, Objective::FEWEST_VIEWS)?;
    means.add("5.3: S of the shortest path, views", shortest.sensing());
    means.add("5.3: S of the path of fewest views", fewest.sensing());
    means.add("5.3: T of the shortest path, s", shortest.time_s(&settings));
    means.add("5.3: T of the quickest path, s", quickest.time_s(&settings));
    let is_quickest = shortest.time_s(&settings) <= quickest.time_s(&settings) + 1e-9;
    shares.add("5.3: the shortest path is the quickest, %", f64::from(u8::from(is_quickest)));
    Ok(())
}
