//! How states are extracted from a sketch, where suites compare that: with additional states and without, by both
//! readings of the objects after the first. And what is published of it.

use sketchnav_schemas::codes::Process;

use super::{STATES, published, tables};
use crate::experiments::suite::Published;
use crate::experiments::trial::Trial;

/// How states are extracted from a sketch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// Whether states are added in wide turns (4.6.2).
    pub is_additional: bool,
    /// Whether objects after the first have their direction alone (table 4.1).
    pub is_by_direction: bool,
}

/// All of them. The first one is what is driven where nothing else is said.
pub const VARIANTS: [Variant; 4] = [
    Variant { is_additional: true, is_by_direction: false },
    Variant { is_additional: false, is_by_direction: false },
    Variant { is_additional: true, is_by_direction: true },
    Variant { is_additional: false, is_by_direction: true },
];

impl Variant {
    /// How its lines differ from those of the first one.
    pub fn words(self) -> String {
        let base = if self.is_additional { "" } else { ", without additional states" };
        format!("{base}{}", if self.is_by_direction { ", others by direction" } else { "" })
    }

    /// How the names of its trials end.
    fn suffix(self) -> String {
        let reading = if self.is_by_direction { tables::DIRECTION_ONLY } else { tables::STRICT };
        format!("{}{}", reading.suffix, if self.is_additional { "" } else { tables::BASE })
    }

    /// The same trial by states that are extracted so, with the same seeds: a line of its own.
    fn of(self, trial: &Trial) -> Trial {
        let mut one = trial.clone();
        one.name += &self.suffix();
        one.drawing += &self.words();
        one.variant_of = Some(trial.name.clone());
        one.method = Some(STATES.into());
        let sketcher = one.mission.parameters.of_mut(Process::Sketcher);
        sketcher.insert("additional_states".into(), self.is_additional.into());
        let others = if self.is_by_direction { "direction-only" } else { "strict" };
        sketcher.insert("other_objects".into(), others.into());
        one
    }
}

/// The same trials by every variant, the first one first.
pub fn variants(trials: &[Trial]) -> Vec<Trial> {
    VARIANTS.iter().flat_map(|variant| trials.iter().map(|trial| variant.of(trial))).collect()
}

/// What is published of both scenes, with additional states and without.
pub fn paper() -> Vec<Published> {
    let published = |scene: &published::Scene, additional: bool| Published {
        name: format!(
            "paper {}{}",
            scene.word.to_uppercase(),
            if additional { "" } else { ", without additional states" }
        ),
        reached: scene.reached[usize::from(additional)] as u32,
        attempts: 5 * scene.sketches.len() as u32,
    };
    let of = |additional: bool| published::SCENES.iter().map(move |scene| published(scene, additional));
    of(true).chain(of(false)).collect()
}
