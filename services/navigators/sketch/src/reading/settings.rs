//! Settings of the sketcher: the mission's `parameters.sketcher` table, and other options for reading a
//! drawing.

use crate::mission::{SketchMission, WallTone};
use serde::{Deserialize, Serialize};
use sketchnav_schemas::codes::Process;
use sketchnav_schemas::mission::{Mission, Parameters};

use super::error::SketchError;

/// Options for reading a drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Tone of the walls.
    pub walls: WallTone,
    /// Seed of the run. The Hough transform draws its votes at random.
    pub seed: u64,
    /// The parameters that can be tuned.
    pub settings: Settings,
}

impl Default for Options {
    fn default() -> Self {
        Self { walls: WallTone::Auto, seed: 1, settings: Settings::default() }
    }
}

impl Options {
    /// Takes the options from a mission.
    ///
    /// # Errors
    /// [`SketchError::Setting`], which names the invalid key of `parameters.sketcher`, or
    /// [`SketchError::Mission`].
    pub fn of_mission(mission: &Mission, seed: u64) -> Result<Self, SketchError> {
        let settings = Settings::of(&mission.parameters)?;
        Ok(Self { walls: SketchMission::of(mission)?.walls, seed, settings })
    }
}

/// Parameters of the sketcher, from the table `parameters.sketcher` of a mission. Shares are relative to the
/// drawing's diagonal, so that they mean the same in small and large drawings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Maximum width of a gap that is closed, in pen widths. 0 leaves all gaps open.
    pub close_gaps_pen_widths: f64,
    /// Standard deviation of the start position, as a share of the diagonal.
    pub start_spread_share: f64,
    /// Standard deviation of the start heading, in degrees.
    pub start_spread_deg: f64,
    /// Distance from its start that a drawn route must reach to determine the start heading, as a share of
    /// the diagonal. People begin with a squiggle, which should not count (Boniardi et al. 2016, IV).
    pub heading_distance_share: f64,
    /// Minimum length of a line that counts for the wall direction, as a share of the diagonal.
    pub line_length_share: f64,
    /// Maximum gap within a line that counts for the wall direction, in pixels.
    pub line_gap_px: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            close_gaps_pen_widths: 1.0,
            start_spread_share: 0.01,
            start_spread_deg: 5.0,
            heading_distance_share: 0.02,
            line_length_share: 0.03,
            line_gap_px: 3,
        }
    }
}

impl Settings {
    /// Takes the settings from a mission's parameters and checks them. Keys that are omitted keep their
    /// defaults.
    ///
    /// # Errors
    /// [`SketchError::Mission`] if a key is unknown or a value of the wrong type, or [`SketchError::Setting`] if a value is out
    /// of range.
    pub fn of(parameters: &Parameters) -> Result<Self, SketchError> {
        let settings = parameters.over(Process::Sketcher, &Self::default())?;
        settings.check()?;
        Ok(settings)
    }

    fn check(&self) -> Result<(), SketchError> {
        let ranges = [
            ("close_gaps_pen_widths", self.close_gaps_pen_widths, 0.0..=20.0),
            ("start_spread_share", self.start_spread_share, 0.0..=1.0),
            ("start_spread_deg", self.start_spread_deg, 0.0..=180.0),
            ("heading_distance_share", self.heading_distance_share, 0.0..=1.0),
            ("line_length_share", self.line_length_share, 0.001..=1.0),
            ("line_gap_px", self.line_gap_px.into(), 0.0..=1000.0),
        ];
        let wrong = ranges.into_iter().find(|(_, value, range)| !range.contains(value));
        wrong.map_or(Ok(()), |(key, value, range)| {
            let reason = format!("expected {} to {}, found {value}", range.start(), range.end());
            Err(SketchError::Setting { key, reason })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Settings, SketchError> {
        Settings::of(&format!("[sketcher]\n{text}").parse().expect("TOML"))
    }

    #[test]
    fn what_is_left_out_keeps_its_default() {
        let settings = parse("start_spread_deg = 9.0").expect("a good table");
        assert_eq!(settings, Settings { start_spread_deg: 9.0, ..Settings::default() });
    }

    #[test]
    fn errors_name_the_key() {
        for (text, word) in [
            ("pen = 3", "pen"),
            ("start_spread_deg = 'five'", "start_spread_deg"),
            ("start_spread_share = -1.0", "start_spread_share"),
            ("close_gaps_pen_widths = nan", "close_gaps_pen_widths"),
        ] {
            let error = parse(text).expect_err(text).to_string();
            assert!(error.contains(word) && error.contains("expected"), "{error}");
        }
    }
}
