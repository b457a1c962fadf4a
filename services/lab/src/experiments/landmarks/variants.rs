//! Variants of extracting states from a sketch, for suites that compare them: with and without additional states, and according to
//! both readings of the conditions on objects other than the most significant one. The published results of the variants are
//! included.

use sketchnav_schemas::codes::Process;

use super::{STATES, published, tables};
use crate::experiments::suite::Published;
use crate::experiments::trial::Trial;

/// A way of extracting states from a sketch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// True if states are added in wide turns (4.6.2).
    pub is_additional: bool,
    /// Whether objects other than the most significant one have only a direction (table 4.1).
    pub is_by_direction: bool,
}

/// All variants. Unless stated otherwise, the first one is used.
pub const VARIANTS: [Variant; 4] = [
    Variant { is_additional: true, is_by_direction: false },
    Variant { is_additional: false, is_by_direction: false },
    Variant { is_additional: true, is_by_direction: true },
    Variant { is_additional: false, is_by_direction: true },
];

impl Variant {
    /// Returns the words that distinguish the variant's lines from those of the first variant.
    pub fn words(self) -> String {
        let base = if self.is_additional { "" } else { ", without additional states" };
        format!("{base}{}", if self.is_by_direction { ", others by direction" } else { "" })
    }

    /// Returns the suffix of the names of the variant's trials.
    fn suffix(self) -> String {
        let reading = if self.is_by_direction { tables::DIRECTION_ONLY } else { tables::STRICT };
        format!("{}{}", reading.suffix, if self.is_additional { "" } else { tables::BASE })
    }

    /// Returns a copy of the trial that extracts states in this way, with the same seeds, for a line of its own.
    fn of(self, trial: &Trial) -> Trial {
        let mut one = trial.clone();
        one.name += &self.suffix();
        one.drawing += &self.words();
        one.variant_of = Some(trial.name.clone());
        one.method = Some(STATES.into());
        let sketcher = one.mission.parameters.of_mut(Process::Sketcher);
        sketcher.insert("additional_states".into(), self.is_additional.into());
        sketcher.insert("other_objects".into(), others(self.is_by_direction).into());
        one
    }
}

/// Returns the value of the sketcher's parameter `other_objects` for either reading.
pub const fn others(is_by_direction: bool) -> &'static str {
    if is_by_direction { "direction-only" } else { "strict" }
}

/// Returns the trials in every variant, starting with the first one.
pub fn variants(trials: &[Trial]) -> Vec<Trial> {
    VARIANTS.iter().flat_map(|variant| trials.iter().map(|trial| variant.of(trial))).collect()
}

/// Returns the published results of both scenes, with and without additional states.
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
